// SPDX-License-Identifier: BSD-3-Clause
// Solutions of (1a) where Λ_J⁻¹ = A M⁻¹ Aᵀ is far worse conditioned than (1a) itself: a part that
// is light beside what constraints hold it to, as a wheel whose mass is all in its hub. With the
// least pivot p of Λ_J⁻¹ beside its diagonal, P_J = M⁻¹ − … loses p⁻² of what M⁻¹ is known to,
// solutions by the factors about p^(−3/2).
#include "contact_flow/dynamics/contact_dynamics.h"

namespace contact_flow {
namespace {

/// Up to as many coordinates a refined inverse costs little: p from here on costs four digits.
constexpr int kFewRefined = 8;
constexpr double kPoorForFew = 1e-2;
/// Beyond, with feet that stick, which solve by rows, and with P_J: eight digits.
constexpr double kPoorByRows = 1e-5, kPoor = 1e-4;
/// Each step squares what is lost.
constexpr int kSteps = 2;

}  // namespace

bool ContactDynamics::IsPoor() const {
  const Matrix& G = at_->delassus_inverse;
  const Matrix& factor = at_->delassus_factor.matrixLLT();
  const double poor = d_ <= kFewRefined ? kPoorForFew : system_.HasFriction() ? kPoorByRows : kPoor;
  for (Eigen::Index i = 0; i < G.rows(); ++i) {
    if (!(factor(i, i) * factor(i, i) > poor * G(i, i))) return true;
  }
  return false;
}

/// By the residuals of (1a), r₁ = f + c v − M v̇ + Aᵀ λ and r₂ = −Ȧ v − A v̇, solved once more.
void ContactDynamics::RefineSolution() {
  const Matrix& A = at_->jacobian;
  for (int step = 0; step < kSteps; ++step) {
    Vector change = applied_ - mass_ * acceleration_ + A.transpose() * at_->multiplier;
    Vector force = -at_->bias - A * acceleration_;
    mass_factor_.SolveL(change);
    force -= at_->reach.transpose() * change;
    at_->delassus_factor.solveInPlace(force);
    change += at_->reach * force;
    mass_factor_.SolveLTransposed(change);
    acceleration_ += change;
    at_->multiplier += force;
  }
}

/// Of K = [M −Aᵀ; A 0], whose inverse is X = [P_J Fᵀ; −F Λ_J] with F = Λ_J A M⁻¹, by Newton's and
/// Schulz's X ← X + X (I − K X).
void ContactDynamics::RefineInverse() {
  const Eigen::Index k = at_->jacobian.rows();
  Matrix K = Matrix::Zero(d_ + k, d_ + k), X(d_ + k, d_ + k);
  K.topLeftCorner(d_, d_) = mass_;
  K.topRightCorner(d_, k) = -at_->jacobian.transpose();
  K.bottomLeftCorner(k, d_) = at_->jacobian;
  X << at_->inverse, at_->force_map.transpose(), -at_->force_map, at_->delassus_inverse;
  for (int step = 0; step < kSteps; ++step) {
    X += (X * (Matrix::Identity(d_ + k, d_ + k) - K * X)).eval();
  }
  at_->inverse = X.topLeftCorner(d_, d_);
  at_->force_map = -X.bottomLeftCorner(k, d_);
  at_->delassus_inverse = X.bottomRightCorner(k, k);
}

}  // namespace contact_flow
