// SPDX-License-Identifier: BSD-3-Clause
#include "slip_directions.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "contact_flow/budget.h"
#include "slip_circle.h"
#include "slip_newton.h"
#include "slip_pairs.h"

namespace contact_flow {
namespace {

constexpr double kTurn = 6.283185307179586;
constexpr int kSamples = 180;       // of the circle; (F5) has at most four roots
constexpr double kOffset = 0.0123;  // of the first: no root of a symmetric problem
constexpr int kBisections = 60;
/// Samples that may hide two roots are below this part of the largest.
constexpr double kNear = 0.1;
/// Starts a contact, where several slip: a grid of them for all.
constexpr int kStarts = 6, kStartsOfMany = 3, kMany = 3, kStartsOfMost = 2, kMost = 5;
constexpr int kSlipNewtonSteps = 40;
/// Directions of one slide are so much alike, relative.
constexpr double kAlike = 1e-9;
constexpr double kQuotient = 1e-7, kConvergedSlip = 1e-13, kSame = 1e-6;

/// d⊥ · y_t of the unknown contacts at angles ψ.
class Directions {
 public:
  Directions(const FrictionProblem& problem, const FrictionSolution& word,
             const std::vector<int>& unknown)
      : problem_(problem), solution_(word), unknown_(unknown) {}

  Vector operator()(const Vector& psi) {
    Vector across(psi.size());
    for (Eigen::Index k = 0; k < psi.size(); ++k) {
      solution_.directions[Contact(k)] = {std::cos(psi(k)), std::sin(psi(k))};
    }
    if (!SolveWord(problem_, &solution_)) return across.setConstant(std::nan(""));
    return Across();
  }
  const FrictionSolution& solution() const { return solution_; }

  /// All at one angle: the sum of d⊥ · y_t, without forces in their cones.
  double Common(double psi) {
    const Eigen::Vector2d d(std::cos(psi), std::sin(psi));
    for (int k : unknown_) solution_.directions[static_cast<std::size_t>(k)] = d;
    if (!SolveWord(problem_, &solution_, false)) return std::nan("");
    return Across().sum();
  }
  /// Whether each slips along its direction.
  bool Fits(double scale) const { return Across().cwiseAbs().maxCoeff() <= kAlike * scale; }

 private:
  Vector Across() const {
    Vector across(static_cast<Eigen::Index>(unknown_.size()));
    for (Eigen::Index k = 0; k < across.size(); ++k) {
      const auto slip = solution_.result.segment<2>(problem_.Row(Contact(k)) + 1);
      const Eigen::Vector2d& d = solution_.directions[Contact(k)];
      across(k) = d(0) * slip(1) - d(1) * slip(0);
    }
    return across;
  }

  std::size_t Contact(Eigen::Index k) const {
    return static_cast<std::size_t>(unknown_[static_cast<std::size_t>(k)]);
  }

  const FrictionProblem& problem_;
  FrictionSolution solution_;
  const std::vector<int>& unknown_;
};

/// A sample of f.
struct Sample {
  double psi, value;
};

/// Calls `add` where f, evaluated by `at`, has a root between two samples.
template <class At, class Add>
void AddRoot(const At& at, Sample left, Sample right, const Add& add) {
  if ((left.value < 0) == (right.value < 0)) return;
  if (!std::isfinite(left.value) || !std::isfinite(right.value)) return;
  double low = left.psi, high = right.psi;
  for (int step = 0; step < kBisections; ++step) {
    const double middle = 0.5 * (low + high);
    ((at(middle) < 0) == (left.value < 0) ? low : high) = middle;
  }
  // A pole changes its sign, too.
  if (std::abs(at(high)) <= std::abs(left.value) + std::abs(right.value)) add();
}

/// Where f comes near to zero at the middle one of three samples of one sign: the point at which it
/// has the other one, or comes nearest.
template <class At>
Sample Dip(const At& at, const Sample& left, const Sample& middle, const Sample& right) {
  constexpr double kGolden = 0.6180339887498949;
  constexpr int kSteps = 30;
  const double sign = middle.value < 0 ? -1 : 1;
  double low = left.psi, high = right.psi;
  Sample a{high - kGolden * (high - low), 0}, b{low + kGolden * (high - low), 0};
  a.value = at(a.psi);
  b.value = at(b.psi);
  for (int step = 0; step < kSteps && sign * a.value > 0 && sign * b.value > 0; ++step) {
    if (sign * a.value < sign * b.value) {
      high = b.psi;
      b = a;
      a.psi = high - kGolden * (high - low);
      a.value = at(a.psi);
    } else {
      low = a.psi;
      a = b;
      b.psi = low + kGolden * (high - low);
      b.value = at(b.psi);
    }
  }
  return sign * a.value < sign * b.value ? a : b;
}

/// Calls `add` where f, evaluated by `at`, has a root: between samples of two signs, and at both
/// sides of a dip below zero between samples of one.
template <class At, class Add>
void ForAllRoots(const At& at, const Add& add) {
  std::vector<Sample> samples;
  double largest = 0;
  for (int k = 0; k <= kSamples + 1; ++k) {
    const double psi = kOffset + kTurn * k / kSamples;
    samples.push_back({psi, at(psi)});
    if (std::isfinite(samples.back().value)) {
      largest = std::max(largest, std::abs(samples.back().value));
    }
  }
  for (std::size_t k = 1; k <= kSamples; ++k) {
    const Sample &left = samples[k - 1], &middle = samples[k], &right = samples[k + 1];
    AddRoot(at, left, middle, add);
    const double size = std::abs(middle.value);
    const bool dips = left.value * middle.value > 0 && right.value * middle.value > 0 &&
                      size <= std::abs(left.value) && size <= std::abs(right.value) &&
                      size < kNear * largest;
    if (!dips) continue;
    const Sample lowest = Dip(at, left, middle, right);
    AddRoot(at, left, lowest, add);
    AddRoot(at, lowest, right, add);
  }
}

/// Those that Newton's method leads to from `starts`.
std::vector<FrictionSolution> SlipsFrom(std::vector<FrictionSolution> starts,
                                        const FrictionProblem& problem,
                                        const std::vector<int>& unknown) {
  std::vector<FrictionSolution> found;
  for (FrictionSolution& start : starts) {
    AskBudget();
    if (!SolveSlipEquations(problem, unknown, &start)) continue;
    const bool known = std::any_of(found.begin(), found.end(), [&](const FrictionSolution& other) {
      return (other.force - start.force).cwiseAbs().maxCoeff() <=
             kSame * other.force.cwiseAbs().maxCoeff();
    });
    if (!known) found.push_back(std::move(start));
  }
  return found;
}

/// Newton's method for the directions of slip, damped, from *psi on.
void IterateSlips(Directions* f, double scale, Vector* psi) {
  const Eigen::Index size = psi->size();
  Vector value = (*f)(*psi);
  for (int step = 0; step < kSlipNewtonSteps && value.allFinite(); ++step) {
    if (value.cwiseAbs().maxCoeff() <= kConvergedSlip * scale) break;
    Matrix slope(size, size);
    for (Eigen::Index k = 0; k < size; ++k) {
      Vector moved = *psi;
      moved(k) += kQuotient;
      slope.col(k) = ((*f)(moved)-value) / kQuotient;
    }
    const Vector change = -slope.partialPivLu().solve(value);
    double part = 1;
    Vector next = (*f)(*psi + change);
    while (part > 1e-3 && !(next.norm() < value.norm())) {
      part *= 0.5;
      next = (*f)(*psi + part * change);
    }
    *psi += part * change;
    value = next;
  }
}

/// What a grid of directions for all contacts leads to.
std::vector<FrictionSolution> SlipsOfGrid(Directions f, Eigen::Index size, double scale) {
  std::vector<FrictionSolution> found;
  const int each = size >= kMost ? kStartsOfMost : size >= kMany ? kStartsOfMany : kStarts;
  long starts = 1;
  for (Eigen::Index k = 0; k < size; ++k) starts *= each;
  for (long start = 0; start < starts; ++start) {
    AskBudget();
    Vector psi(size);
    long digits = start;
    for (Eigen::Index k = 0; k < size; ++k, digits /= each) {
      psi(k) = kOffset + kTurn * static_cast<double>(digits % each) / each;
    }
    IterateSlips(&f, scale, &psi);
    if (f(psi).allFinite()) found.push_back(f.solution());
  }
  return found;
}

}  // namespace

std::vector<FrictionSolution> FindSlipDirections(const FrictionProblem& problem,
                                                 const FrictionSolution& word,
                                                 const std::vector<int>& unknown) {
  std::vector<FrictionSolution> starts;
  if (unknown.size() == 1) {
    for (const Eigen::Vector2d& d : SlipDirectionsOfOne(problem, word, unknown.front())) {
      starts.push_back(word);
      starts.back().directions[static_cast<std::size_t>(unknown.front())] = d;
    }
  } else if (unknown.size() > 2 || !SlipDirectionsOfTwo(problem, word, unknown, &starts)) {
    starts =
        SlipsOfGrid(Directions(problem, word, unknown), static_cast<Eigen::Index>(unknown.size()),
                    problem.b.cwiseAbs().maxCoeff());
  }
  return SlipsFrom(std::move(starts), problem, unknown);
}

std::vector<FrictionSolution> FindCommonSlip(const FrictionProblem& problem,
                                             const FrictionSolution& word,
                                             const std::vector<int>& unknown) {
  std::vector<FrictionSolution> found;
  Directions f(problem, word, unknown);
  ForAllRoots([&](double psi) { return f.Common(psi); },
              [&] {
                FrictionSolution solution = f.solution();
                if (f.Fits(problem.b.cwiseAbs().maxCoeff()) && SolveWord(problem, &solution)) {
                  found.push_back(std::move(solution));
                }
              });
  return found;
}

bool PolishSlips(const FrictionProblem& problem, FrictionSolution* word) {
  std::vector<int> unknown;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const FrictionContact& contact = problem.contacts[i];
    const bool turns = word->letters[i] == Letter::kSlip && contact.dimension == 2;
    if (turns && !contact.slips) unknown.push_back(static_cast<int>(i));
  }
  if (unknown.empty()) return SolveWord(problem, word);
  FrictionSolution polished = *word;
  bool found = SolveSlipEquations(problem, unknown, &polished);
  if (!found) {  // from farther away
    Vector psi(static_cast<Eigen::Index>(unknown.size()));
    for (Eigen::Index k = 0; k < psi.size(); ++k) {
      const Eigen::Vector2d& d =
          word->directions[static_cast<std::size_t>(unknown[static_cast<std::size_t>(k)])];
      psi(k) = std::atan2(d(1), d(0));
    }
    Directions f(problem, *word, unknown);
    IterateSlips(&f, problem.b.cwiseAbs().maxCoeff(), &psi);
    f(psi);
    polished = f.solution();
    found = SolveSlipEquations(problem, unknown, &polished);
  }
  if (found) *word = std::move(polished);
  return found;
}

}  // namespace contact_flow
