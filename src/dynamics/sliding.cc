// SPDX-License-Identifier: BSD-3-Clause
// What slipping contacts add to the dynamics in a contact mode, (F3).
#include <cmath>
#include <limits>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/model/row_layout.h"

namespace contact_flow {

/// A contact whose coefficient is 0 slips, too, where that is a variable: by it there is a force of
/// first order, against the slip.
void ContactDynamics::AddFriction() {
  int column = 0;
  const Matrix by_parameter = variables_.parameters.empty()
                                  ? Matrix::Zero(system_.num_constraints(), 0)
                                  : system_.DifferentiateFriction(variables_.parameters);
  for (int i : at_->mode - system_.compliant()) {
    const Friction& friction = system_.friction()[i];
    const Letter letter = at_->mode.LetterOf(i);
    if (letter == Letter::kStick) {
      RowLayout(system_).AddTangential(i, &at_->active);
    } else if (friction.dimension > 0 &&
               (friction.coefficient > 0 || !by_parameter.row(i).isZero(0))) {
      Sliding sliding{i, column, friction, Eigen::Vector2d::Zero(), 0, {}};
      sliding.direction(0) = SlipSign(letter);
      at_->turning = at_->turning || friction.dimension == 2 || !(friction.coefficient > 0);
      at_->sliding.push_back(sliding);
    }
    ++column;
  }
}

void ContactDynamics::FactorizeSliding(const VectorRef& x) {
  at_->push = at_->reach;
  const auto friction_acts = [](const Sliding& s) { return s.friction.coefficient > 0; };
  for (Sliding& s : at_->sliding) {
    const auto rows = terms_.jacobian.middleRows(s.friction.row, s.friction.dimension);
    if (s.friction.dimension == 2) {
      const Eigen::Vector2d slip = rows * x.tail(d_);
      s.speed = slip.norm();
      s.direction = slip / s.speed;
      if (!(friction_acts(s) || s.speed > 0)) s.direction.setZero();
    } else if (!friction_acts(s)) {
      s.direction(0) = rows.row(0).dot(x.tail(d_)) < 0 ? -1 : 1;
    }
    Vector tangential = rows.transpose() * s.direction.head(s.friction.dimension);
    mass_factor_.SolveL(tangential);
    at_->push.col(s.column) -= s.friction.coefficient * tangential;
  }
  at_->delassus_inverse.noalias() = at_->reach.transpose().lazyProduct(at_->push);
  at_->sliding_factor.compute(at_->delassus_inverse);
  at_->dependent = FindSlidingDependence();
  if (at_->dependent) return;
  const auto& factor = at_->sliding_factor.matrixLU();
  at_->regular = at_->regular && factor.allFinite() && factor.diagonal().cwiseAbs().minCoeff() > 0;
}

/// Pivot by pivot, as their product may overflow.
double ContactDynamics::slip_regularity() const {
  if (at_ == nullptr || at_->sliding.empty() || at_->dependent) {
    return std::numeric_limits<double>::infinity();
  }
  double product = at_->sliding_factor.permutationP().determinant();
  for (Eigen::Index k = 0; k < at_->reach.cols(); ++k) {
    product *= at_->sliding_factor.matrixLU()(k, k) / at_->reach.col(k).squaredNorm();
  }
  return product;
}

void ContactDynamics::AddSlidingForce() {
  for (const Sliding& s : at_->sliding) {
    force_.segment(s.friction.row, s.friction.dimension) = -s.friction.coefficient *
                                                           at_->multiplier(s.column) *
                                                           s.direction.head(s.friction.dimension);
  }
}

/// In space the direction turns: ∂d = (I − d dᵀ)/|s| ∂(T v), by parameters of T, too.
void ContactDynamics::DifferentiateDirections(const VectorRef& x) {
  const auto q = x.head(nq_), v = x.tail(d_);
  if (at_->turning) {
    ResidualJacobian slip;  // ∂(T v) by q
    system_.DifferentiateImpact(q, Vector::Zero(d_), Vector::Zero(n_), v, &slip);
    ParameterJacobian slip_by_parameter;
    const auto parameters = static_cast<Eigen::Index>(variables_.parameters.size());
    if (parameters > 0) {
      system_.DifferentiateImpactByParameters(q, Vector::Zero(d_), Vector::Zero(n_), v,
                                              variables_.parameters, &slip_by_parameter);
    }
    for (Sliding& s : at_->sliding) {
      if (s.friction.dimension < 2 || s.friction.coefficient == 0) continue;
      const auto rows = terms_.jacobian.middleRows<2>(s.friction.row);
      Matrix by = Matrix::Zero(2, 2 * d_ + k_);
      by.leftCols(2 * d_) << slip.constraint_q.middleRows<2>(s.friction.row), rows;
      if (parameters > 0) {
        by.rightCols(parameters) = slip_by_parameter.constraint.middleRows<2>(s.friction.row);
      }
      const Eigen::Matrix2d across =
          (Eigen::Matrix2d::Identity() - s.direction * s.direction.transpose()) / s.speed;
      s.direction_jacobian = across * by;
      // r₁ = … − Tᵀ λ_t, λ_t = −μ λ_n d.
      const Matrix turned = s.friction.coefficient * at_->multiplier(s.column) *
                            (rows.transpose() * s.direction_jacobian);
      residual_.momentum_q += turned.leftCols(d_);
      residual_.momentum_v += turned.middleCols(d_, d_);
      if (parameters > 0) variable_momentum_.rightCols(parameters) += turned.rightCols(parameters);
    }
  }
  if (variables_.parameters.empty()) return;
  const Matrix by_parameter = system_.DifferentiateFriction(variables_.parameters);
  for (const Sliding& s : at_->sliding) {
    const auto rows = terms_.jacobian.middleRows(s.friction.row, s.friction.dimension);
    variable_momentum_.rightCols(by_parameter.cols()) +=
        at_->multiplier(s.column) * (rows.transpose() * s.direction.head(s.friction.dimension)) *
        by_parameter.row(s.constraint);
  }
}

/// D(−μ λ_n d).
void ContactDynamics::DifferentiateSlidingForce() {
  const Matrix by_parameter = variables_.parameters.empty()
                                  ? Matrix()
                                  : system_.DifferentiateFriction(variables_.parameters);
  for (const Sliding& s : at_->sliding) {
    const Vector d = s.direction.head(s.friction.dimension);
    auto rows = force_jacobian_.middleRows(s.friction.row, s.friction.dimension);
    rows = -s.friction.coefficient * d * force_jacobian_.row(s.constraint);
    if (s.direction_jacobian.size() > 0) {
      rows -= s.friction.coefficient * at_->multiplier(s.column) * s.direction_jacobian;
    }
    if (by_parameter.size() > 0) {
      rows.rightCols(by_parameter.cols()) -=
          at_->multiplier(s.column) * d * by_parameter.row(s.constraint);
    }
  }
}

}  // namespace contact_flow
