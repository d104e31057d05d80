// SPDX-License-Identifier: BSD-3-Clause
#include "slip_directions.h"

#include <Eigen/LU>
#include <cmath>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

constexpr double kTurn = 6.283185307179586;
constexpr int kSamples = 180;       // of the circle; (F5) has at most four roots
constexpr double kOffset = 0.0123;  // of the first: no root of a symmetric problem
constexpr int kBisections = 60;
/// Starts a contact, where several slip: a grid of them for all.
constexpr int kStarts = 6, kStartsOfMany = 3, kMany = 3, kStartsOfMost = 2, kMost = 5;
constexpr int kNewtonSteps = 40;
/// Directions of one slide are so much alike, relative.
constexpr double kAlike = 1e-9;
constexpr double kQuotient = 1e-7, kConverged = 1e-13, kSame = 1e-6;

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

/// Calls `add` where f, evaluated by `at`, has a root.
template <class At, class Add>
void ForAllRoots(const At& at, const Add& add) {
  double low = kOffset, before = at(low);
  for (int k = 1; k <= kSamples; ++k) {
    double high = kOffset + kTurn * k / kSamples;
    const double end = high, after = at(high);
    if ((before < 0) != (after < 0) && std::isfinite(before) && std::isfinite(after)) {
      double left = low;
      for (int step = 0; step < kBisections; ++step) {
        const double middle = 0.5 * (left + high);
        ((at(middle) < 0) == (before < 0) ? left : high) = middle;
      }
      // A pole changes its sign, too.
      if (std::abs(at(high)) <= std::abs(before) + std::abs(after)) add();
    }
    low = end;
    before = after;
  }
}

std::vector<FrictionSolution> AllRoots(Directions f) {
  std::vector<FrictionSolution> found;
  ForAllRoots([&](double psi) { return f(Vector::Constant(1, psi))(0); },
              [&] { found.push_back(f.solution()); });
  return found;
}

std::vector<FrictionSolution> NewtonRoots(Directions f, Eigen::Index size, double scale) {
  std::vector<FrictionSolution> found;
  std::vector<Vector> roots;
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
    Vector value = f(psi);
    for (int step = 0; step < kNewtonSteps && value.allFinite(); ++step) {
      if (value.cwiseAbs().maxCoeff() <= kConverged * scale) break;
      Matrix slope(size, size);
      for (Eigen::Index k = 0; k < size; ++k) {
        Vector moved = psi;
        moved(k) += kQuotient;
        slope.col(k) = (f(moved) - value) / kQuotient;
      }
      Vector change = -slope.partialPivLu().solve(value);
      double part = 1;
      Vector next = f(psi + change);
      while (part > 1e-3 && !(next.norm() < value.norm())) {
        part *= 0.5;
        next = f(psi + part * change);
      }
      psi += part * change;
      value = next;
    }
    if (!(value.cwiseAbs().maxCoeff() <= 1e3 * kConverged * scale)) continue;
    f(psi);
    bool known = false;
    for (const FrictionSolution& other : found) {
      known = known || (other.force - f.solution().force).cwiseAbs().maxCoeff() <=
                           kSame * (1e-300 + other.force.cwiseAbs().maxCoeff());
    }
    if (!known) found.push_back(f.solution());
  }
  return found;
}

}  // namespace

std::vector<FrictionSolution> FindSlipDirections(const FrictionProblem& problem,
                                                 const FrictionSolution& word,
                                                 const std::vector<int>& unknown) {
  const Directions f(problem, word, unknown);
  if (unknown.size() == 1) return AllRoots(f);
  return NewtonRoots(f, static_cast<Eigen::Index>(unknown.size()), problem.b.cwiseAbs().maxCoeff());
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

}  // namespace contact_flow
