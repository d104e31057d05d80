// SPDX-License-Identifier: BSD-3-Clause
#include "impulse_jacobian.h"

#include <Eigen/QR>
#include <stdexcept>
#include <vector>

#include "contact_flow/model/row_layout.h"

namespace contact_flow {

Matrix ImpulseJacobian(const MechanicalSystem& system, const InverseInertia& inertia,
                       const VectorRef& q, const VectorRef& v_minus, const ImpactResult& result,
                       const ConstraintSet& hit, const ConstraintSet& persisting) {
  const int d = system.dof(), n = system.num_constraints();
  Matrix jump =
      ImpactJacobian(system, inertia, q, v_minus, result, hit, persisting).block(d, 0, d, 2 * d);
  jump.rightCols(d).diagonal().array() -= 1;  // ∂(v⁺ − v⁻)
  ResidualJacobian residual;
  system.DifferentiateImpact(q, result.v_plus - v_minus, result.impulse, result.v_plus, &residual);
  Matrix right = inertia.mass() * jump;
  right.leftCols(d) += residual.momentum_q;
  const std::vector<int> rows = RowLayout(system).Closed(hit);
  Matrix At(d, static_cast<Eigen::Index>(rows.size()));
  for (Eigen::Index k = 0; k < At.cols(); ++k) {
    At.col(k) = inertia.terms().jacobian.row(rows[static_cast<std::size_t>(k)]).transpose();
  }
  const Eigen::ColPivHouseholderQR<Matrix> factor(At);
  if (factor.rank() < At.cols()) {
    throw std::domain_error("the impulses of an impact are not unique: they have no derivative");
  }
  const Matrix rates = factor.solve(right);
  Matrix all = Matrix::Zero(n, 2 * d);
  for (Eigen::Index k = 0; k < At.cols(); ++k) {
    const int row = rows[static_cast<std::size_t>(k)];
    if (row < n) all.row(row) = rates.row(k);
  }
  return all;
}

}  // namespace contact_flow
