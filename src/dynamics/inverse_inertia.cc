// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/inverse_inertia.h"

namespace contact_flow {

InverseInertia::InverseInertia(const MechanicalSystem& system, const VectorRef& q,
                               const VectorRef& v, const VectorRef& u, ContactMode mode)
    : n_(system.num_constraints()) {
  system.Dynamics(q, v, u, mode, &mass_, &applied_);
  system.Constraints(q, v, &terms_);
  mass_factor_.compute(mass_);
  if (system.num_bilateral() == 0) return;
  const auto B = terms_.jacobian.bottomRows(system.num_bilateral());
  reach_ = mass_factor_.solve(B.transpose());
  bilateral_factor_.compute(B * reach_);
}

InverseInertia::InverseInertia(const MechanicalSystem& system, const VectorRef& q,
                               const VectorRef& v)
    : InverseInertia(system, q, v, Vector::Zero(system.num_inputs()), ContactMode()) {}

Matrix InverseInertia::Rows(ContactMode members) const {
  Matrix rows(members.Size(), terms_.jacobian.cols());
  int row = 0;
  for (int i : members) rows.row(row++) = terms_.jacobian.row(i);
  return rows;
}

Matrix InverseInertia::operator*(const MatrixRef& R) const {
  Matrix result = mass_factor_.solve(R);
  if (reach_.cols() > 0) result -= reach_ * bilateral_factor_.solve(reach_.transpose() * R);
  return result;
}

Matrix InverseInertia::BilateralForce(const MatrixRef& R) const {
  if (reach_.cols() == 0) return Matrix(0, R.cols());
  return -bilateral_factor_.solve(reach_.transpose() * R);
}

Vector InverseInertia::FreeAcceleration() const {
  Vector acceleration = *this * applied_;
  if (reach_.cols() > 0) {
    acceleration -= reach_ * bilateral_factor_.solve(terms_.bias.tail(reach_.cols()));
  }
  return acceleration;
}

Vector InverseInertia::Correction(const VectorRef& r) const {
  return -reach_ * bilateral_factor_.solve(r);
}

}  // namespace contact_flow
