// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/piecewise_linear/linear_program.h"

#include <cmath>
#include <stdexcept>
#include <string>
#if CONTACT_FLOW_HAVE_CLP
#include <coin/ClpEventHandler.hpp>
#include <coin/ClpSimplex.hpp>
#include <vector>

#include "contact_flow/budget.h"
#endif

namespace contact_flow {

#if CONTACT_FLOW_HAVE_CLP

bool HaveLinearPrograms() { return true; }

namespace {

constexpr double kTolerance = 1e-9;
/// Smaller coefficients, relative to the largest of their row, are rounding errors. Clp takes them
/// as pivots and returns points that are not optimal.
constexpr double kNegligible = 1e-14;
/// Clp ends the process where a coefficient is 1e25 or more.
constexpr double kLargest = 1e20;

/// What brings numbers of such a size to 1; a power of two, so that no bit of them is lost. 1 for
/// those that may stay.
double ScaleOf(double largest) {
  return largest > kLargest ? std::ldexp(1.0, -std::ilogb(largest)) : 1;
}

/// Stops a program whose budget is used up, from one pivot to the next.
class BudgetGuard : public ClpEventHandler {
 public:
  int event(Event) override {
    try {
      AskBudget();
      return -1;  // go on
    } catch (const BudgetExceeded&) {
      return 5;  // "stopped by an event"
    }
  }
  ClpEventHandler* clone() const override { return new BudgetGuard(*this); }
};

}  // namespace

struct LinearProgram::Solver {
  ClpSimplex problem;
  Matrix rows;
  Vector lower, upper;
  bool finite = false;  // what is no number cannot be solved

  /// Feasible, and no better point exists: for any λ ≥ 0, objective·y ≤ (objective + rowsᵀλ)·y ≤
  /// its largest value between the bounds.
  bool Verifies(const VectorRef& objective, const Vector& y, double value) const {
    if (!y.allFinite() || (rows.rows() > 0 && (rows * y).minCoeff() < -10 * kTolerance)) {
      return false;
    }
    if ((y - lower).minCoeff() < -kTolerance || (upper - y).minCoeff() < -kTolerance) return false;
    const Vector duals = Eigen::Map<const Vector>(problem.dualRowSolution(), rows.rows());
    const double allowed = 10 * kTolerance * (1 + objective.cwiseAbs().sum());
    for (double sign : {1.0, -1.0}) {
      const Vector reduced = objective + rows.transpose() * (sign * duals).cwiseMax(0.0);
      const double bound = reduced.cwiseProduct(lower).cwiseMax(reduced.cwiseProduct(upper)).sum();
      if (bound <= value + allowed) return true;
    }
    return false;
  }
};

LinearProgram::LinearProgram(const MatrixRef& rows, const VectorRef& lower, const VectorRef& upper)
    : solver_(std::make_unique<Solver>()) {
  const int h = static_cast<int>(rows.rows()), n = static_cast<int>(rows.cols());
  if (lower.size() != n || upper.size() != n) {
    throw std::invalid_argument("a linear program in " + std::to_string(n) +
                                " unknowns needs as many bounds");
  }
  solver_->finite = rows.allFinite() && lower.allFinite() && upper.allFinite();
  if (!solver_->finite) return;
  solver_->rows = rows;
  for (int r = 0; r < h; ++r) {
    solver_->rows.row(r) *= ScaleOf(n > 0 ? rows.row(r).cwiseAbs().maxCoeff() : 0);
  }
  solver_->lower = lower;
  solver_->upper = upper;
  AskMemory(
      20.0 * static_cast<double>(rows.size()),
      "a linear program of " + std::to_string(h) + " rows and " + std::to_string(n) + " columns");
  const Matrix& scaled = solver_->rows;
  const Vector largest = scaled.cwiseAbs().rowwise().maxCoeff();
  std::vector<CoinBigIndex> start;
  std::vector<int> index;
  std::vector<double> value;
  for (int c = 0; c < n; ++c) {
    start.push_back(static_cast<CoinBigIndex>(index.size()));
    for (int r = 0; r < h; ++r) {
      if (std::abs(scaled(r, c)) <= kNegligible * largest(r)) continue;
      index.push_back(r);
      value.push_back(scaled(r, c));
    }
  }
  start.push_back(static_cast<CoinBigIndex>(index.size()));
  const std::vector<double> objective(n, 0.0), zero(h, 0.0), unbounded(h, COIN_DBL_MAX);
  ClpSimplex& problem = solver_->problem;
  problem.setLogLevel(0);
  problem.scaling(0);
  problem.setPrimalTolerance(kTolerance);
  problem.setDualTolerance(kTolerance);
  problem.loadProblem(n, h, start.data(), index.data(), value.data(), solver_->lower.data(),
                      solver_->upper.data(), objective.data(), zero.data(), unbounded.data());
  problem.setOptimizationDirection(-1);
  if (HasBudget()) {
    BudgetGuard guard;
    problem.passInEventHandler(&guard);
  }
}

std::optional<LinearOptimum> LinearProgram::Maximize(const VectorRef& asked) {
  if (!solver_->finite || !asked.allFinite()) return {};
  ClpSimplex& problem = solver_->problem;
  const int n = problem.numberColumns();
  const Vector objective = asked * ScaleOf(asked.size() > 0 ? asked.cwiseAbs().maxCoeff() : 0);
  if (objective.size() != n) {
    throw std::invalid_argument("an objective of " + std::to_string(objective.size()) +
                                " entries for a linear program in " + std::to_string(n));
  }
  for (int c = 0; c < n; ++c) problem.setObjectiveCoefficient(c, objective(c));
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (attempt == 0) {
      problem.primal();
    } else {
      problem.allSlackBasis();
      problem.dual();
    }
    AskBudget();  // not solved, but stopped
    if (!problem.isProvenOptimal()) continue;
    LinearOptimum optimum;
    optimum.point = Eigen::Map<const Vector>(problem.primalColumnSolution(), n);
    optimum.value = asked.dot(optimum.point);
    if (std::isfinite(optimum.value) &&
        solver_->Verifies(objective, optimum.point, objective.dot(optimum.point))) {
      return optimum;
    }
  }
  return {};
}

#else

bool HaveLinearPrograms() { return false; }

struct LinearProgram::Solver {};

LinearProgram::LinearProgram(const MatrixRef&, const VectorRef&, const VectorRef&) {}
std::optional<LinearOptimum> LinearProgram::Maximize(const VectorRef&) { return {}; }

#endif

LinearProgram::~LinearProgram() = default;
LinearProgram::LinearProgram(LinearProgram&&) noexcept = default;
LinearProgram& LinearProgram::operator=(LinearProgram&&) noexcept = default;

}  // namespace contact_flow
