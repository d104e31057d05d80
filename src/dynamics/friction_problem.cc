// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/friction_problem.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "dependent_words.h"
#include "friction_group.h"
#include "known_pads.h"
#include "row_units.h"
#include "word_margins.h"

namespace contact_flow {
namespace {

/// Rows of a word are dependent where a pivot is below this part of the largest.
constexpr double kDependent = 1e-12;

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

/// SolveWord of a problem whose rows can be compared.
bool SolveWordOnScale(const FrictionProblem& problem, FrictionSolution* solution, bool share) {
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

}  // namespace

int FrictionProblem::Row(std::size_t contact) const {
  int row = 0;
  for (std::size_t i = 0; i < contact; ++i) row += 1 + contacts[i].dimension;
  return row;
}

bool SolveWord(const FrictionProblem& problem, FrictionSolution* solution, bool share) {
  const RowUnits units(problem);
  if (!units.Any()) return SolveWordOnScale(problem, solution, share);
  const bool solved = SolveWordOnScale(units.Scaled(problem), solution, share);
  if (solved) units.Return(solution);
  return solved;
}

std::vector<FrictionSolution> SolveFriction(const FrictionProblem& problem, double border) {
  return SolveFrictionFrom(problem, border, {});
}

namespace {

/// Group by group.
std::vector<FrictionSolution> SolveGroups(const FrictionProblem& problem, double border,
                                          const std::vector<Letter>& before) {
  std::vector<FrictionSolution> solutions = {WithoutForces(problem, problem.b)};
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
    std::vector<Letter> letters;
    for (std::size_t i : group) {
      if (!before.empty()) letters.push_back(before[i]);
    }
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
    const RowUnits units(part);
    if (units.Any()) part = units.Scaled(part);
    for (FrictionSolution& found : SolveGroup(part, border, letters)) {
      if (units.Any()) units.Return(&found);
      for (FrictionSolution whole : solutions) {
        whole.many = whole.many || found.many;
        whole.springs = whole.springs || found.springs;
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

}  // namespace

std::vector<FrictionSolution> SolveFrictionFrom(const FrictionProblem& problem, double border,
                                                const std::vector<Letter>& before) {
  const KnownPads pads(problem);
  std::vector<FrictionSolution> solutions =
      SolveGroups(pads.Rest(), border, pads.LettersOf(before));
  for (FrictionSolution& solution : solutions) solution = pads.Whole(solution);
  return solutions;
}

}  // namespace contact_flow
