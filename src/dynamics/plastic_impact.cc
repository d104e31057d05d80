// SPDX-License-Identifier: BSD-3-Clause
#include "plastic_impact.h"

#include <Eigen/QR>
#include <stdexcept>

#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/model/row_layout.h"

namespace contact_flow {

ImpactResult PlasticImpact(const MechanicalSystem& system, const VectorRef& q,
                           const VectorRef& v_minus, const ConstraintSet& J) {
  if (J.Empty()) return {v_minus, Vector::Zero(system.num_rows()), J};
  const InverseInertia inertia(system, q, v_minus);
  const Matrix A = inertia.Rows(J);
  const Matrix Y = inertia * A.transpose();
  const Matrix G = A * Y;
  const Vector scale = G.diagonal().cwiseSqrt().cwiseInverse();
  Eigen::CompleteOrthogonalDecomposition<Matrix> factor;
  factor.setThreshold(kDependentRow);
  factor.compute(scale.asDiagonal() * G * scale.asDiagonal());
  if (!factor.matrixQTZ().allFinite()) {
    throw std::domain_error("the plastic impact of touching constraints is not finite");
  }
  const Vector p = -scale.cwiseProduct(factor.solve(scale.cwiseProduct(A * v_minus)));
  ImpactResult result;
  result.v_plus = v_minus + Y * p;
  if (!result.v_plus.allFinite()) {
    throw std::domain_error("the velocity after a plastic impact is not finite");
  }
  result.impulse = Vector::Zero(system.num_rows());
  result.hit = J;
  int row = 0;
  for (int i : J) result.impulse(i) = p(row++);
  RowLayout(system).Bilateral(result.impulse) =
      inertia.BilateralForce(Matrix(A.transpose() * p)).col(0);
  return result;
}

}  // namespace contact_flow
