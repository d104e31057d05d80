// SPDX-License-Identifier: BSD-3-Clause
#include "piece_step.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "contact_flow/budget.h"
#include "quadratic_program.h"

namespace contact_flow {
namespace {

/// Pivots of H below this part of their diagonal entries are rounding; these are then lifted by
/// this part. Each beside its own, since unknowns have units of their own.
constexpr double kSingularStep = 1e-13, kLift = 1e-9;

const char* Sentence(QuadraticFailure failure) {
  switch (failure) {
    case QuadraticFailure::kContradiction:
      return "no step within the bounds keeps the order of events of a piece";
    case QuadraticFailure::kNotFinite:
      return "the first or second order of a piece is not finite";
    case QuadraticFailure::kUnfinished:
      return "the step of a piece was not found: too many bounds and orders were tried";
  }
  return "";
}

}  // namespace

Vector SizesOfCurvature(const Matrix& H) {
  const Vector sizes = H.diagonal().cwiseAbs();
  const double largest = sizes.size() > 0 ? sizes.maxCoeff() : 0;
  return (sizes.array() > 0).select(sizes, largest > 0 ? largest : 1.0);
}

Eigen::LLT<Matrix> FactorOf(const Matrix& H) {
  AskBudget();
  Eigen::LLT<Matrix> factor(H);
  const Vector sizes = H.diagonal().cwiseAbs();
  const double largest = sizes.maxCoeff();
  const auto pivots = factor.matrixLLT().diagonal().array().square();
  const bool regular = factor.info() == Eigen::Success &&
                       (sizes.array() > 0 && pivots > kSingularStep * sizes.array()).all();
  if (regular || !std::isfinite(largest)) return factor;
  Matrix lifted = H;
  lifted.diagonal() += (largest > 0 ? kLift : 1) * SizesOfCurvature(H);
  factor.compute(lifted);
  return factor;
}

PieceStep SolvePiece(const PieceModel& piece, const Vector& y, const Vector& lower,
                     const Vector& upper, OrderRule rule, const std::vector<int>& equal,
                     double damping) {
  const Eigen::Index n = y.size();
  Matrix H = piece.hessian;
  H.diagonal() += damping * SizesOfCurvature(H);
  const Eigen::LLT<Matrix> factor = FactorOf(H);
  PieceStep step;
  step.d = Vector::Zero(n);
  step.multipliers = Vector::Zero(static_cast<Eigen::Index>(piece.orders.size()));
  step.bounded.assign(static_cast<std::size_t>(n), false);
  if (factor.info() != Eigen::Success) {
    step.failure = Sentence(QuadraticFailure::kNotFinite);
    return step;
  }
  std::vector<std::size_t> rows;
  QuadraticProgram program{factor, piece.gradient, lower - y, upper - y, {}, {}, {}};
  for (std::size_t r = 0; r < piece.orders.size(); ++r) {
    const bool is = std::count(equal.begin(), equal.end(), static_cast<int>(r)) > 0;
    if (!is && rule == OrderRule::kIgnore) continue;
    rows.push_back(r);
    program.equal.push_back(is);
  }
  program.A.resize(static_cast<Eigen::Index>(rows.size()), n);
  program.b.resize(program.A.rows());
  for (Eigen::Index i = 0; i < program.A.rows(); ++i) {
    const OrderRow& order = piece.orders[rows[static_cast<std::size_t>(i)]];
    program.A.row(i) = order.row;
    program.b(i) = order.slack;
  }
  QuadraticFailure why;
  const std::optional<QuadraticSolution> solution = Solve(program, &why);
  if (!solution) {
    step.failure = Sentence(why);
    step.reachable = why != QuadraticFailure::kContradiction;
    return step;
  }
  step.d = solution->d;
  step.bounded = solution->bounded;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    step.multipliers(static_cast<Eigen::Index>(rows[i])) =
        solution->multipliers(static_cast<Eigen::Index>(i));
  }
  const Vector force = piece.gradient + H * step.d - program.A.transpose() * solution->multipliers;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (step.bounded[static_cast<std::size_t>(i)]) continue;
    step.residual = std::max(step.residual, std::abs(force(i)));
  }
  step.decrease = -(piece.gradient.dot(step.d) + 0.5 * step.d.dot(piece.hessian * step.d));
  step.solved = true;
  return step;
}

}  // namespace contact_flow
