// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/friction_problem.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include "contact_flow/budget.h"
#include "dependent_words.h"
#include "slip_directions.h"

namespace contact_flow {
namespace {

/// Rows of a word are dependent where a pivot is below this part of the largest.
constexpr double kDependent = 1e-12;
/// Motions that differ by less than this are one, and a slack above this is room, relative.
constexpr double kSameMotion = 1e-8, kRoom = 1e-7;

/// The letters that a contact may have.
std::vector<Letter> Alphabet(const FrictionContact& contact) {
  if (contact.dimension == 0 || (contact.slips && contact.dimension == 2)) {
    return {Letter::kOpen, Letter::kSlip};
  }
  if (contact.slips) {
    return {Letter::kOpen, contact.direction(0) > 0 ? Letter::kForward : Letter::kBackward};
  }
  if (std::isinf(contact.coefficient)) return {Letter::kOpen, Letter::kStick};
  if (contact.dimension == 1) {
    return {Letter::kOpen, Letter::kStick, Letter::kForward, Letter::kBackward};
  }
  return {Letter::kOpen, Letter::kStick, Letter::kSlip};
}

bool Slips(Letter letter) { return letter != Letter::kOpen && letter != Letter::kStick; }

/// The slack of the tightest inequality, with what it may miss, relative to `scale`.
double Margin(const FrictionProblem& problem, const FrictionSolution& s, double scale) {
  double margin = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const FrictionContact& contact = problem.contacts[i];
    const int row = problem.Row(i);
    const double gain = problem.G(row, row);
    const Vector& share = s.interior.size() > 0 ? s.interior : s.force;
    const auto force = share.segment(row + 1, contact.dimension);
    const auto slip = s.result.segment(row + 1, contact.dimension);
    const double may_miss = problem.slack.size() > 0 ? problem.slack(static_cast<int>(i)) : 0;
    if (s.letters[i] == Letter::kOpen) {
      margin = std::min(margin, s.result(row) + may_miss);
      continue;
    }
    const bool cone = s.letters[i] == Letter::kStick && std::isfinite(contact.coefficient);
    // The apex of the cone: both vanish together.
    const double pushes = cone ? contact.coefficient * share(row) - force.norm() : share(row);
    margin = std::min(margin, gain * pushes + may_miss);
    if (Slips(s.letters[i]) && contact.dimension > 0 && !contact.slips) {
      margin = std::min(margin, s.directions[i].head(contact.dimension).dot(slip) + may_miss);
    }
  }
  return margin / scale;
}

/// Without forces.
FrictionSolution Nothing(const FrictionProblem& problem, const Vector& result) {
  FrictionSolution none;
  none.letters.assign(problem.contacts.size(), Letter::kOpen);
  none.directions.assign(problem.contacts.size(), Eigen::Vector2d::Zero());
  none.force = Vector::Zero(problem.b.size());
  none.result = result;
  none.margin = std::numeric_limits<double>::infinity();
  return none;
}

/// The slack of contact i alone, relative.
double SlackOf(const FrictionProblem& problem, const FrictionSolution& s, std::size_t i) {
  const FrictionContact& contact = problem.contacts[i];
  const int row = problem.Row(i);
  const Vector& share = s.interior.size() > 0 ? s.interior : s.force;
  const bool cone = s.letters[i] == Letter::kStick && std::isfinite(contact.coefficient);
  const double slack =
      cone ? contact.coefficient * share(row) - share.segment(row + 1, contact.dimension).norm()
           : share(row);
  return problem.G(row, row) * slack;
}

/// Whether `other` is the motion of `word` with less contact, or less that sticks, where `word` has
/// room for it: a box on a diagonal of its face.
bool Covers(const FrictionProblem& problem, const FrictionSolution& word,
            const FrictionSolution& other, double scale) {
  if (word.many || word.letters == other.letters) return false;
  if ((word.result - other.result).cwiseAbs().maxCoeff() > kSameMotion * scale) return false;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    if (word.letters[i] == other.letters[i]) continue;
    const bool less = word.letters[i] == Letter::kStick || other.letters[i] == Letter::kOpen;
    if (!less || word.letters[i] == Letter::kOpen) return false;
    if (!(SlackOf(problem, word, i) > kRoom * scale)) return false;
  }
  return true;
}

/// Whether all that may stick does, with room.
bool SticksWithRoom(const FrictionProblem& problem, double scale) {
  FrictionSolution word;
  for (const FrictionContact& contact : problem.contacts) {
    const std::vector<Letter> letters = Alphabet(contact);
    word.letters.push_back(letters[1]);
    word.directions.push_back(contact.direction);
  }
  return SolveWord(problem, &word) && !word.many && Margin(problem, word, scale) > kRoom;
}

/// Of one group of contacts that feel each other.
std::vector<FrictionSolution> SolveGroup(const FrictionProblem& problem, double border) {
  const std::size_t n = problem.contacts.size();
  if (n > kMaxCoupledContacts) {
    throw std::domain_error(std::to_string(n) +
                            " contacts with friction feel each other: at most " +
                            std::to_string(kMaxCoupledContacts) + " are decided together");
  }
  if (problem.rounding.size() > 0 &&
      (problem.b.cwiseAbs().array() <= problem.rounding.array()).all()) {
    return {Nothing(problem, Vector::Zero(problem.b.size()))};
  }
  double scale = problem.b.cwiseAbs().maxCoeff();
  if (!(scale > 0)) scale = 1;
  std::vector<std::vector<Letter>> alphabet;
  for (const FrictionContact& contact : problem.contacts) alphabet.push_back(Alphabet(contact));
  const ImpliedLetters implied(problem);
  const bool stuck = implied.Any() && SticksWithRoom(problem, scale);
  std::vector<FrictionSolution> solutions;
  std::vector<std::size_t> place(n, 0);
  while (true) {
    AskBudget();
    FrictionSolution word;
    std::vector<int> unknown;  // contacts in space that begin to slip
    for (std::size_t i = 0; i < n; ++i) {
      const FrictionContact& contact = problem.contacts[i];
      word.letters.push_back(alphabet[i][place[i]]);
      word.directions.push_back(contact.direction);
      if (word.letters[i] == Letter::kForward) word.directions[i] = {1, 0};
      if (word.letters[i] == Letter::kBackward) word.directions[i] = {-1, 0};
      const bool turns = word.letters[i] == Letter::kSlip && contact.dimension == 2;
      if (turns && !contact.slips) unknown.push_back(static_cast<int>(i));
    }
    const auto offer = [&](FrictionSolution found) {
      found.margin = Margin(problem, found, scale);
      if (found.margin >= -border) solutions.push_back(std::move(found));
    };
    if (implied.Any() && ((stuck && !unknown.empty()) || implied.Change(word.letters))) {
      // The word of what is implied is another one.
    } else if (!unknown.empty() && implied.Any() && implied.Dependent(word.letters)) {
      for (FrictionSolution& found : FindCommonSlip(problem, word, unknown)) offer(found);
    } else if (!unknown.empty()) {
      for (FrictionSolution& found : FindSlipDirections(problem, word, unknown)) offer(found);
    } else if (SolveWord(problem, &word)) {
      offer(word);
    }
    std::size_t i = 0;
    while (i < n && ++place[i] == alphabet[i].size()) place[i++] = 0;
    if (i < n) continue;
    if (!implied.Any()) return solutions;
    std::vector<FrictionSolution> apart;
    for (const FrictionSolution& one : solutions) {
      const bool covered =
          std::any_of(solutions.begin(), solutions.end(), [&](const FrictionSolution& word) {
            return Covers(problem, word, one, scale);
          });
      if (!covered) apart.push_back(one);
    }
    return apart;
  }
}

/// Contacts in groups that do not feel each other.
std::vector<std::vector<std::size_t>> Groups(const FrictionProblem& problem) {
  const std::size_t n = problem.contacts.size();
  std::vector<std::size_t> root(n);
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](std::size_t i) {
    while (root[i] != i) i = root[i];
    return i;
  };
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const auto block =
          problem.G.block(problem.Row(i), problem.Row(j), 1 + problem.contacts[i].dimension,
                          1 + problem.contacts[j].dimension);
      const double own = std::sqrt(problem.G(problem.Row(i), problem.Row(i)) *
                                   problem.G(problem.Row(j), problem.Row(j)));
      if (block.cwiseAbs().maxCoeff() > std::numeric_limits<double>::epsilon() * own) {
        root[find(i)] = find(j);
      }
    }
  }
  std::vector<std::vector<std::size_t>> groups(n);
  for (std::size_t i = 0; i < n; ++i) groups[find(i)].push_back(i);
  groups.erase(
      std::remove_if(groups.begin(), groups.end(), [](const auto& group) { return group.empty(); }),
      groups.end());
  return groups;
}

}  // namespace

int FrictionProblem::Row(std::size_t contact) const {
  int row = 0;
  for (std::size_t i = 0; i < contact; ++i) row += 1 + contacts[i].dimension;
  return row;
}

bool SolveWord(const FrictionProblem& problem, FrictionSolution* solution, bool share) {
  const Eigen::Index size = problem.b.size();
  Matrix columns = Matrix::Zero(size, size);
  std::vector<int> rows;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const Letter letter = solution->letters[i];
    if (letter == Letter::kOpen) continue;
    const FrictionContact& contact = problem.contacts[i];
    const int row = problem.Row(i);
    columns(row, static_cast<Eigen::Index>(rows.size())) = 1;
    if (letter != Letter::kStick) {
      columns.block(row + 1, static_cast<Eigen::Index>(rows.size()), contact.dimension, 1) =
          -contact.coefficient * solution->directions[i].head(contact.dimension);
    }
    rows.push_back(row);
    if (letter != Letter::kStick) continue;
    for (int k = 1; k <= contact.dimension; ++k) {
      columns(row + k, static_cast<Eigen::Index>(rows.size())) = 1;
      rows.push_back(row + k);
    }
  }
  const auto m = static_cast<Eigen::Index>(rows.size());
  solution->force = Vector::Zero(size);
  if (m > 0) {
    const Matrix push = problem.G * columns.leftCols(m);
    Matrix H(m, m);
    Vector rhs(m);
    for (Eigen::Index r = 0; r < m; ++r) {
      const int row = rows[static_cast<std::size_t>(r)];
      H.row(r) = push.row(row);
      rhs(r) = -problem.b(row);
    }
    // Rows and columns in units of their own.
    Vector unit(m);
    for (Eigen::Index r = 0; r < m; ++r) {
      const int row = rows[static_cast<std::size_t>(r)];
      unit(r) = 1 / std::sqrt(problem.G(row, row));
    }
    H = unit.asDiagonal() * H * unit.asDiagonal();
    Eigen::FullPivLU<Matrix> factor(H);
    factor.setThreshold(kDependent);
    if (!H.allFinite()) return false;
    if (factor.rank() < m) {
      return SolveDependentWord(problem, columns.leftCols(m), rows, share, solution);
    }
    solution->force =
        columns.leftCols(m) * (unit.asDiagonal() * factor.solve(unit.asDiagonal() * rhs));
  }
  solution->interior.resize(0);
  solution->many = false;
  solution->result = problem.G * solution->force + problem.b;
  return solution->force.allFinite();
}

std::vector<FrictionSolution> SolveFriction(const FrictionProblem& problem, double border) {
  std::vector<FrictionSolution> solutions = {Nothing(problem, problem.b)};
  for (const std::vector<std::size_t>& group : Groups(problem)) {
    FrictionProblem part;
    std::vector<int> rows;
    for (std::size_t i : group) {
      part.contacts.push_back(problem.contacts[i]);
      for (int k = 0; k <= problem.contacts[i].dimension; ++k) rows.push_back(problem.Row(i) + k);
    }
    const auto m = static_cast<Eigen::Index>(rows.size());
    part.G.resize(m, m);
    part.b.resize(m);
    if (problem.slack.size() > 0) part.slack.resize(static_cast<Eigen::Index>(group.size()));
    for (Eigen::Index k = 0; k < part.slack.size(); ++k) {
      part.slack(k) = problem.slack(static_cast<Eigen::Index>(group[static_cast<std::size_t>(k)]));
    }
    if (problem.rounding.size() > 0) part.rounding.resize(m);
    for (Eigen::Index r = 0; r < m; ++r) {
      part.b(r) = problem.b(rows[static_cast<std::size_t>(r)]);
      if (part.rounding.size() > 0) {
        part.rounding(r) = problem.rounding(rows[static_cast<std::size_t>(r)]);
      }
      for (Eigen::Index c = 0; c < m; ++c) {
        part.G(r, c) =
            problem.G(rows[static_cast<std::size_t>(r)], rows[static_cast<std::size_t>(c)]);
      }
    }
    std::vector<FrictionSolution> all;
    for (const FrictionSolution& found : SolveGroup(part, border)) {
      for (FrictionSolution whole : solutions) {
        whole.many = whole.many || found.many;
        if (found.interior.size() > 0 && whole.interior.size() == 0) whole.interior = whole.force;
        for (std::size_t k = 0; k < group.size(); ++k) {
          whole.letters[group[k]] = found.letters[k];
          whole.directions[group[k]] = found.directions[k];
        }
        for (Eigen::Index r = 0; r < m; ++r) {
          whole.force(rows[static_cast<std::size_t>(r)]) = found.force(r);
          if (whole.interior.size() > 0) {
            whole.interior(rows[static_cast<std::size_t>(r)]) =
                found.interior.size() > 0 ? found.interior(r) : found.force(r);
          }
          whole.result(rows[static_cast<std::size_t>(r)]) = found.result(r);
        }
        whole.margin = std::min(whole.margin, found.margin);
        all.push_back(whole);
      }
    }
    solutions = std::move(all);
  }
  return solutions;
}

}  // namespace contact_flow
