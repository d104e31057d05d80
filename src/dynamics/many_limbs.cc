// SPDX-License-Identifier: BSD-3-Clause
// The factors of (1a) where M has many zeros, and rates of forces along the motion.
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "solve_columns.h"

namespace contact_flow {

namespace {

/// A force below this part of the largest one may vanish at the instant, as in SelectMode.
constexpr double kNearlyDecoupled = 1e-4;

}  // namespace

bool ContactDynamics::PushClearly(const VectorRef& x, const ConstraintSet& contacts,
                                  const ConstraintSet& pressed) {
  if (!mass_factor_.sparse() || system_.HasFriction() || system_.HasContactEffort() ||
      system_.num_bilateral() > 0 || contacts.Empty()) {
    return false;
  }
  Evaluate(x, ContactMode(contacts | pressed));
  if (!at_->regular || constant_) return false;
  const Vector& force = at_->multiplier;
  if (!(force.minCoeff() > 0)) return false;
  // As ForceModes::Find judges: every force beside the terms of all.
  column_ = applied_;
  mass_factor_.SolveL(column_);
  mass_factor_.SolveLTransposed(column_);
  const Matrix& G = at_->delassus_inverse;
  const double applied = applied_.cwiseAbs().maxCoeff();
  double scale = force.maxCoeff();
  for (Eigen::Index i = 0; i < force.size(); ++i) {
    const double gain = G(i, i), pivot = at_->delassus_factor.matrixLLT()(i, i);
    if (!(pivot * pivot >= kDependentRow * gain)) return false;
    const auto row = at_->jacobian.row(i).cwiseAbs();
    const double terms = row.dot(column_.cwiseAbs()) + std::abs(at_->bias(i)) +
                         G.col(i).cwiseAbs().dot(force.cwiseAbs());
    scale = std::max(scale, terms / gain + applied / row.maxCoeff());
  }
  return force.minCoeff() > kNearlyDecoupled * (1 + scale);
}

void ContactDynamics::InvertSparse() {
  SolveColumns(at_->delassus_factor, &at_->delassus_inverse);
  at_->response = at_->reach;  // becomes M⁻¹ A_Jᵀ
  mass_factor_.SolveLTransposed(&at_->response);
  at_->momentum_map = at_->response.transpose();
  at_->force_map.noalias() = at_->delassus_inverse * at_->momentum_map;
  at_->inverse.noalias() -= at_->momentum_map.transpose() * at_->force_map;
}

Vector ContactDynamics::ForceRate(const VectorRef& x, const ContactMode& mode) {
  Differentiate(x, mode);
  return force_jacobian_.leftCols(d_) * x.tail(d_) +
         force_jacobian_.middleCols(d_, d_) * acceleration_;
}

double ContactDynamics::ForceRate(const VectorRef& x, const ContactMode& mode, int i) {
  Differentiate(x, mode);
  return force_jacobian_.row(i).head(d_).dot(x.tail(d_)) +
         force_jacobian_.row(i).segment(d_, d_).dot(acceleration_);
}

/// The residual's derivative along (v, v̇), and one solution of (1a) for it:
///   M δv̇ − A_Jᵀ δλ = −∂r₁,   A_J δv̇ = −∂r₂.
const Vector& ContactDynamics::ForceRates(const VectorRef& x, const ContactMode& mode) {
  Evaluate(x, mode);
  const auto q = x.head(nq_), v = x.tail(d_);
  if (constant_ || at_->dependent || at_->poor || !at_->sliding.empty()) {
    DifferentiateEvaluated(x);
    force_rate_.resize(n_);
    for (int i = 0; i < n_; ++i) {
      force_rate_(i) = force_jacobian_.row(i).head(d_).dot(v) +
                       force_jacobian_.row(i).segment(d_, d_).dot(acceleration_);
    }
    return force_rate_;
  }
  system_.DifferentiateDynamicsOfMode(q, v, u_, mode, acceleration_, force_, &residual_);
  momentum_rate_.noalias() = residual_.momentum_q * v;
  momentum_rate_.noalias() += residual_.momentum_v * acceleration_;
  mass_factor_.SolveL(momentum_rate_);  // −y
  const auto k = static_cast<Eigen::Index>(at_->active.size());
  multiplier_rate_.resize(k);
  for (Eigen::Index i = 0; i < k; ++i) {
    const int row = at_->active[i];
    multiplier_rate_(i) = at_->reach.col(i).dot(momentum_rate_) -
                          residual_.constraint_q.row(row).dot(v) -
                          residual_.constraint_v.row(row).dot(acceleration_);
  }
  if (k > 0) at_->delassus_factor.solveInPlace(multiplier_rate_);
  if (!at_->regular) multiplier_rate_.setConstant(std::numeric_limits<double>::quiet_NaN());
  force_rate_.setZero(n_);
  for (Eigen::Index i = 0; i < k; ++i) force_rate_(at_->active[i]) = multiplier_rate_(i);
  return force_rate_;
}

}  // namespace contact_flow
