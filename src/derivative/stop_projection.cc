// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <limits>
#include <vector>

#include "contact_flow/dynamics/guards.h"
#include "frictional_reset.h"

namespace contact_flow {
namespace {

/// Pivots below this part of the largest are those of rows that depend on others.
constexpr double kDependent = 1e-10;

}  // namespace

Matrix SolveConsistent(const Matrix& A, const Vector& unit, const Matrix& B) {
  Eigen::CompleteOrthogonalDecomposition<Matrix> factor;
  factor.setThreshold(kDependent);
  factor.compute(unit.asDiagonal() * A * unit.asDiagonal());
  return unit.asDiagonal() * factor.solve(unit.asDiagonal() * B);
}

namespace {

/// Whether nothing that pushes moves row k but its own column: it keeps its rate without a push. So
/// the pads of joints that slip, whose columns are in units of their own.
bool Unmoved(const Matrix& H, const Vector& gain, Eigen::Index k) {
  const double felt = std::numeric_limits<double>::epsilon();
  for (Eigen::Index j = 0; j < H.cols(); ++j) {
    if (j != k && std::abs(H(k, j)) > felt * std::sqrt(gain(k) * gain(j))) return false;
  }
  return true;
}

/// What ends the slips of `stopping`, and the normal rates of `landing`.
Matrix EndRates(ContactDynamics* dynamics, const Vector& x, ContactMode mode,
                ConstraintSet stopping, ConstraintSet landing, const Matrix& rate_jacobian) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions();
  const InverseInertia inertia(system, x.head(nq), x.tail(d));
  const Matrix& A = inertia.terms().jacobian;
  std::vector<int> rows, stopped;  // places in `rows`
  std::vector<Vector> pushes;
  for (int i : mode - system.compliant()) {
    const Friction& friction = system.friction()[i];
    const Letter letter = mode.LetterOf(i);
    if (landing.Contains(i)) stopped.push_back(static_cast<int>(rows.size()));
    rows.push_back(i);
    pushes.push_back(A.row(i).transpose());
    if (letter == Letter::kStick) {
      for (int k = 0; k < friction.dimension; ++k) {
        if (stopping.Contains(i)) stopped.push_back(static_cast<int>(rows.size()));
        rows.push_back(friction.row + k);
        pushes.push_back(A.row(friction.row + k).transpose());
      }
    } else if (friction.dimension > 0 && friction.coefficient > 0) {
      const auto T = A.middleRows(friction.row, friction.dimension);
      Vector direction(1);
      direction(0) = SlipSign(letter);
      if (friction.dimension == 2) direction = (T * x.tail(d)).normalized();
      pushes.back() -= friction.coefficient * (T.transpose() * direction);
    }
  }
  const auto m = static_cast<Eigen::Index>(rows.size());
  Matrix active(m, d), push(d, m);
  for (Eigen::Index k = 0; k < m; ++k) {
    active.row(k) = A.row(rows[static_cast<std::size_t>(k)]);
    push.col(k) = pushes[static_cast<std::size_t>(k)];
  }
  const Matrix reach = inertia * push;
  Matrix wanted = Matrix::Zero(m, rate_jacobian.cols());
  for (int place : stopped) {
    wanted.row(place) = rate_jacobian.row(rows[static_cast<std::size_t>(place)]);
  }
  Matrix projection = Matrix::Identity(rate_jacobian.cols(), rate_jacobian.cols());
  const Matrix all = active * reach;
  const Vector gain = (active * (inertia * active.transpose())).diagonal();
  std::vector<Eigen::Index> pushing;
  for (Eigen::Index k = 0; k < m; ++k) {
    if (!wanted.row(k).isZero(0) || !Unmoved(all, gain, k)) pushing.push_back(k);
  }
  const auto n = static_cast<Eigen::Index>(pushing.size());
  if (n == 0) return projection;
  const Matrix H = all(pushing, pushing), asked = wanted(pushing, Eigen::all);
  const Vector unit = gain(pushing).cwiseSqrt().cwiseInverse();
  Eigen::FullPivLU<Matrix> ranks(unit.asDiagonal() * H * unit.asDiagonal());
  ranks.setThreshold(kDependent);
  projection.middleRows(d, d) -=
      reach(Eigen::all, pushing) *
      (ranks.rank() < n ? SolveConsistent(H, unit, asked) : Matrix(H.partialPivLu().solve(asked)));
  return projection;
}

}  // namespace

Matrix StopProjection(ContactDynamics* dynamics, const Vector& x, ContactMode mode,
                      ConstraintSet stopping, const Matrix& rate_jacobian) {
  return EndRates(dynamics, x, mode, stopping, {}, rate_jacobian);
}

Matrix LandingProjection(ContactDynamics* dynamics, const Vector& x, ContactMode mode,
                         ConstraintSet landing, const Matrix& rate_jacobian) {
  return EndRates(dynamics, x, mode, landing, landing, rate_jacobian);
}

Matrix RateJacobian(const ContactDynamics& dynamics, const Vector& x) {
  const MechanicalSystem& system = dynamics.system();
  const int d = system.dof(), nq = system.num_positions(), rows = system.num_rows();
  const Vector q = x.head(nq), v = x.tail(d);
  ConstraintTerms terms;
  system.Constraints(q, v, &terms);
  ResidualJacobian by;
  system.DifferentiateImpact(q, Vector::Zero(d), Vector::Zero(rows), v, &by);
  Matrix jacobian = Matrix::Zero(rows, 2 * d + dynamics.num_variables());
  jacobian.leftCols(d) = by.constraint_q;
  jacobian.middleCols(d, d) = terms.jacobian;
  const std::vector<int>& parameters = dynamics.variables().parameters;
  if (!parameters.empty()) {
    ParameterJacobian by_parameter;
    system.DifferentiateImpactByParameters(q, Vector::Zero(d), Vector::Zero(rows), v, parameters,
                                           &by_parameter);
    jacobian.rightCols(by_parameter.constraint.cols()) = by_parameter.constraint;
  }
  return jacobian;
}

}  // namespace contact_flow
