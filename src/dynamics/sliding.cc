// SPDX-License-Identifier: BSD-3-Clause
// What slipping contacts add to the dynamics in a contact mode, (F3).
#include <cmath>
#include <limits>

#include "contact_flow/dynamics/contact_dynamics.h"

namespace contact_flow {

void ContactDynamics::FactorizeSliding(const VectorRef& x) {
  push_ = reach_;
  for (Sliding& s : sliding_) {
    const auto rows = terms_.jacobian.middleRows(s.friction.row, s.friction.dimension);
    if (s.friction.dimension == 2) {
      const Eigen::Vector2d slip = rows * x.tail(d_);
      s.speed = slip.norm();
      s.direction = slip / s.speed;
    }
    Vector tangential = rows.transpose() * s.direction.head(s.friction.dimension);
    mass_factor_.matrixL().solveInPlace(tangential);
    push_.col(s.column) -= s.coefficient * tangential;
  }
  delassus_inverse_.noalias() = reach_.transpose().lazyProduct(push_);
  sliding_factor_.compute(delassus_inverse_);
  regular_ = regular_ && sliding_factor_.matrixLU().allFinite() &&
             sliding_factor_.matrixLU().diagonal().cwiseAbs().minCoeff() > 0;
}

void ContactDynamics::AddSlidingForce() {
  for (const Sliding& s : sliding_) {
    force_.segment(s.friction.row, s.friction.dimension) =
        -s.coefficient * multiplier_(s.column) * s.direction.head(s.friction.dimension);
  }
}

/// In space the direction turns: ∂d = (I − d dᵀ)/|s| ∂(T v).
void ContactDynamics::DifferentiateDirections(const VectorRef& x) {
  direction_jacobian_.assign(sliding_.size(), Matrix());
  const auto q = x.head(nq_), v = x.tail(d_);
  if (turning_) {
    ResidualJacobian slip;  // ∂(T v) by q
    system_.DifferentiateImpact(q, Vector::Zero(d_), Vector::Zero(n_), v, &slip);
    for (std::size_t k = 0; k < sliding_.size(); ++k) {
      const Sliding& s = sliding_[k];
      if (s.friction.dimension < 2) continue;
      const auto rows = terms_.jacobian.middleRows<2>(s.friction.row);
      Eigen::Matrix<double, 2, Eigen::Dynamic> by(2, 2 * d_);
      by << slip.constraint_q.middleRows<2>(s.friction.row), rows;
      const Eigen::Matrix2d across =
          (Eigen::Matrix2d::Identity() - s.direction * s.direction.transpose()) / s.speed;
      direction_jacobian_[k] = across * by;
      // r₁ = … − Tᵀ λ_t, λ_t = −μ λ_n d.
      const Matrix turned = s.coefficient * multiplier_(s.column) *
                            (rows.transpose() * direction_jacobian_[k]);
      residual_.momentum_q += turned.leftCols(d_);
      residual_.momentum_v += turned.rightCols(d_);
    }
  }
  if (variables_.parameters.empty()) return;
  const Matrix by_parameter = system_.DifferentiateFriction(variables_.parameters);
  for (const Sliding& s : sliding_) {
    const auto rows = terms_.jacobian.middleRows(s.friction.row, s.friction.dimension);
    variable_momentum_.rightCols(by_parameter.cols()) +=
        multiplier_(s.column) *
        (rows.transpose() * s.direction.head(s.friction.dimension)) *
        by_parameter.row(s.constraint);
  }
}

/// D(−μ λ_n d).
void ContactDynamics::DifferentiateSlidingForce() {
  const Matrix by_parameter = variables_.parameters.empty()
                                  ? Matrix()
                                  : system_.DifferentiateFriction(variables_.parameters);
  for (std::size_t k = 0; k < sliding_.size(); ++k) {
    const Sliding& s = sliding_[k];
    const Vector d = s.direction.head(s.friction.dimension);
    auto rows = force_jacobian_.middleRows(s.friction.row, s.friction.dimension);
    rows = -s.coefficient * d * force_jacobian_.row(s.constraint);
    if (direction_jacobian_[k].size() > 0) {
      rows.leftCols(2 * d_) -= s.coefficient * multiplier_(s.column) * direction_jacobian_[k];
    }
    if (by_parameter.size() > 0) {
      rows.rightCols(by_parameter.cols()) -=
          multiplier_(s.column) * d * by_parameter.row(s.constraint);
    }
  }
}

}  // namespace contact_flow
