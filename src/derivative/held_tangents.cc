// SPDX-License-Identifier: BSD-3-Clause
#include "held_tangents.h"

#include <Eigen/QR>

namespace contact_flow {

Matrix WithoutSpan(const Matrix& rows, const Matrix& w) {
  if (rows.rows() == 0) return w;
  const Matrix columns = rows.transpose();
  return w - columns * columns.completeOrthogonalDecomposition().solve(w);
}

Matrix HeldTangents(const ContactDynamics& dynamics, const ConstraintTerms& terms,
                    const std::vector<int>& closed, const std::vector<int>& still, const Vector& q,
                    const Vector& v) {
  const MechanicalSystem& system = dynamics.system();
  const int d = system.dof(), k = dynamics.num_variables();
  const std::vector<int>& parameters = dynamics.variables().parameters;
  const auto p = static_cast<Eigen::Index>(parameters.size());
  const Vector no_jump = Vector::Zero(d), no_impulse = Vector::Zero(terms.gap.size());
  ResidualJacobian residual;
  system.DifferentiateImpact(q, no_jump, no_impulse, v, &residual);
  ParameterJacobian by;
  if (p > 0) system.DifferentiateImpactByParameters(q, no_jump, no_impulse, v, parameters, &by);
  Matrix rows =
      Matrix::Zero(static_cast<Eigen::Index>(2 * closed.size() + still.size()), 2 * d + k);
  Eigen::Index row = 0;
  for (int i : closed) {
    rows.row(row).head(d) = terms.jacobian.row(i);
    if (p > 0) rows.row(row).tail(p) = by.gap.row(i);
    ++row;
  }
  for (const std::vector<int>& all : {closed, still}) {
    for (int i : all) {
      rows.row(row).head(d) = residual.constraint_q.row(i);
      rows.row(row).segment(d, d) = terms.jacobian.row(i);
      if (p > 0) rows.row(row).tail(p) = by.constraint.row(i);
      ++row;
    }
  }
  return rows;
}

}  // namespace contact_flow
