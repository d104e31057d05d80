// SPDX-License-Identifier: BSD-3-Clause
#include "rest_reset.h"

#include <vector>

#include "contact_flow/model/driven.h"
#include "contact_flow/model/row_layout.h"
#include "frictional_reset.h"
#include "src/dynamics/rest_impulse.h"

namespace contact_flow {

// The implicit function theorem on
//   r₁ = M (v⁺ − v) − W p = 0,   A v⁺ = 0,
// with the direction of a slip in space, d = T v/|T v|, in W.
RestReset ResetToRest(const ContactDynamics& dynamics, const Vector& x, ContactMode mode) {
  const MechanicalSystem& system = dynamics.system();
  const int d = system.dof(), nq = system.num_positions();
  const Vector q = x.head(nq), v = x.tail(d);
  const InverseInertia inertia(system, q, v);
  const Matrix& A = inertia.terms().jacobian;
  const RestImpulse rest = BringToRest(system, inertia, v, mode);
  std::vector<RestingRow> rows = RestingRows(system, A, v, mode);
  for (int i = 0; i < system.num_bilateral(); ++i) {
    const int row = RowLayout(system).OfBilateral(i);
    rows.push_back({row, A.row(row).transpose()});
  }

  const std::vector<int>& parameters = dynamics.variables().parameters;
  const int size = 2 * d + dynamics.num_variables();
  const auto m = static_cast<Eigen::Index>(rows.size());
  const auto num_parameters = static_cast<Eigen::Index>(parameters.size());
  Matrix kkt = Matrix::Zero(d + m, d + m), rhs = Matrix::Zero(d + m, size);
  const Vector jump = rest.v_plus - v;
  ResidualJacobian by;
  system.DifferentiateImpact(q, jump, rest.impulse, rest.v_plus, &by);
  kkt.topLeftCorner(d, d) = inertia.mass();
  rhs.block(0, d, d, d) = inertia.mass();
  rhs.topLeftCorner(d, d) = -by.momentum_q;
  ParameterJacobian by_parameter;
  if (num_parameters > 0) {
    system.DifferentiateImpactByParameters(q, jump, rest.impulse, rest.v_plus, parameters,
                                           &by_parameter);
    rhs.topRightCorner(d, num_parameters) = -by_parameter.momentum;
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    const RestingRow& resting = rows[static_cast<std::size_t>(k)];
    kkt.col(d + k).head(d) = -resting.push;
    kkt.row(d + k).head(d) = A.row(resting.row);
    rhs.row(d + k).head(d) = -by.constraint_q.row(resting.row);
    if (num_parameters == 0) continue;
    rhs.row(d + k).tail(num_parameters) = -by_parameter.constraint.row(resting.row);
  }

  // By coefficients of friction, and by the directions of slips.
  const Matrix rate_jacobian = RateJacobian(dynamics, x);
  const Matrix friction_by_parameter = system.DifferentiateFriction(parameters);
  for (int i : mode - system.compliant()) {
    const Friction& friction = system.friction()[i];
    const bool rubs = friction.dimension > 0 && friction.coefficient > 0;
    if (!rubs || mode.LetterOf(i) == Letter::kStick) continue;
    const auto T = A.middleRows(friction.row, friction.dimension);
    const Vector along = rest.impulse.segment(friction.row, friction.dimension);
    rhs.topRightCorner(d, num_parameters) +=
        T.transpose() * (along / friction.coefficient) * friction_by_parameter.row(i);
    if (friction.dimension != 2) continue;
    const Eigen::Vector2d slip = T * v, direction = slip.normalized();
    rhs.topRows(d) -= friction.coefficient * rest.impulse(i) / slip.norm() * T.transpose() *
                      (Eigen::Matrix2d::Identity() - direction * direction.transpose()) *
                      rate_jacobian.middleRows<2>(friction.row);
  }

  // What is driven goes on as before.
  for (int j : Driven(inertia.mass())) {
    kkt.row(j) = Vector::Unit(d + m, j).transpose();
    rhs.row(j) = Vector::Unit(size, d + j).transpose();
  }
  Vector unit = kkt.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
  for (Eigen::Index k = 0; k < m; ++k) {
    unit(d + k) = 1 / kkt.row(d + k).head(d).cwiseProduct(unit.head(d).transpose()).norm();
  }
  RestReset reset{rest.v_plus, Matrix::Identity(size, size)};
  reset.jacobian.middleRows(d, d) = SolveConsistent(kkt, unit, rhs).topRows(d);
  return reset;
}

}  // namespace contact_flow
