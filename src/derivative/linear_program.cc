// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/linear_program.h"

#include <stdexcept>
#if CONTACT_FLOW_HAVE_CLP
#include <coin/ClpSimplex.hpp>
#include <vector>
#endif

namespace contact_flow {

#if CONTACT_FLOW_HAVE_CLP

bool HaveLinearPrograms() { return true; }

struct LinearProgram::Solver {
  ClpSimplex problem;
};

LinearProgram::LinearProgram(const MatrixRef& rows, const VectorRef& lower, const VectorRef& upper)
    : solver_(std::make_unique<Solver>()) {
  constexpr double kTolerance = 1e-9;
  const int h = static_cast<int>(rows.rows()), n = static_cast<int>(rows.cols());
  if (lower.size() != n || upper.size() != n) {
    throw std::invalid_argument("a linear program in " + std::to_string(n) +
                                " unknowns needs as many bounds");
  }
  std::vector<CoinBigIndex> start;
  std::vector<int> index;
  std::vector<double> value;
  for (int c = 0; c < n; ++c) {
    start.push_back(static_cast<CoinBigIndex>(index.size()));
    for (int r = 0; r < h; ++r) {
      if (rows(r, c) == 0) continue;
      index.push_back(r);
      value.push_back(rows(r, c));
    }
  }
  start.push_back(static_cast<CoinBigIndex>(index.size()));
  const std::vector<double> objective(n, 0.0), zero(h, 0.0), unbounded(h, COIN_DBL_MAX);
  const Vector least = lower, most = upper;
  ClpSimplex& problem = solver_->problem;
  problem.setLogLevel(0);
  problem.setPrimalTolerance(kTolerance);
  problem.setDualTolerance(kTolerance);
  problem.loadProblem(n, h, start.data(), index.data(), value.data(), least.data(), most.data(),
                      objective.data(), zero.data(), unbounded.data());
  problem.setOptimizationDirection(-1);
}

LinearOptimum LinearProgram::Maximize(const VectorRef& objective) {
  ClpSimplex& problem = solver_->problem;
  const int n = problem.numberColumns();
  if (objective.size() != n) {
    throw std::invalid_argument("an objective of " + std::to_string(objective.size()) +
                                " entries for a linear program in " + std::to_string(n));
  }
  for (int c = 0; c < n; ++c) problem.setObjectiveCoefficient(c, objective(c));
  problem.primal();
  LinearOptimum optimum;
  optimum.solved = problem.isProvenOptimal();
  if (!optimum.solved) return optimum;
  optimum.point = Eigen::Map<const Vector>(problem.primalColumnSolution(), n);
  optimum.value = objective.dot(optimum.point);
  return optimum;
}

#else

bool HaveLinearPrograms() { return false; }

struct LinearProgram::Solver {};

LinearProgram::LinearProgram(const MatrixRef&, const VectorRef&, const VectorRef&) {}
LinearOptimum LinearProgram::Maximize(const VectorRef&) { return {}; }

#endif

LinearProgram::~LinearProgram() = default;
LinearProgram::LinearProgram(LinearProgram&&) noexcept = default;
LinearProgram& LinearProgram::operator=(LinearProgram&&) noexcept = default;

}  // namespace contact_flow
