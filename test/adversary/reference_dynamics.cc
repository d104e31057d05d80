// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/reference_dynamics.h"

#include <cmath>
#include <limits>

namespace contact_flow {
namespace adversary {
namespace {

constexpr double kDependent = 1e-14;  // of a row in the span of those before, relative

}  // namespace

void ReferenceDynamics::Factor(Small* S) {
  Small& L = *S;
  const Eigen::Index k = L.rows();
  for (Eigen::Index j = 0; j < k; ++j) {
    double pivot = L(j, j);
    for (Eigen::Index m = 0; m < j; ++m) pivot -= L(j, m) * L(j, m);
    const bool dependent = pivot <= kDependent * L(j, j);
    L(j, j) = dependent ? std::numeric_limits<double>::infinity() : std::sqrt(pivot);
    for (Eigen::Index i = j + 1; i < k; ++i) {
      double sum = L(i, j);
      for (Eigen::Index m = 0; m < j; ++m) sum -= L(i, m) * L(j, m);
      L(i, j) = sum / L(j, j);
    }
  }
}

void ReferenceDynamics::Forward(const Small& L, Eigen::Ref<SmallVector> y) {
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    for (Eigen::Index m = 0; m < i; ++m) y(i) -= L(i, m) * y(m);
    y(i) /= L(i, i);
  }
}

void ReferenceDynamics::Backward(const Small& L, Eigen::Ref<SmallVector> y) {
  for (Eigen::Index i = y.size() - 1; i >= 0; --i) {
    for (Eigen::Index m = i + 1; m < y.size(); ++m) y(i) -= L(m, i) * y(m);
    y(i) /= L(i, i);
  }
}

// With M = L Lᵀ and W = L⁻¹ Aᵀ: Wᵀ W λ = −(A M⁻¹ h + bias), v̇ = L⁻ᵀ (L⁻¹ h + W λ).
void ReferenceDynamics::Solve(const VectorRef& x, const Vector& u, ConstraintSet mode) {
  const int d = system_.dof(), n = system_.num_constraints();
  system_.Dynamics(x.head(d), x.tail(d), u, ContactMode(mode), &mass_, &applied_);
  factor_ = mass_;
  Factor(&factor_);
  acceleration_ = applied_;
  Forward(factor_, acceleration_);
  force_.setZero(n);
  if (!mode.Empty()) {
    system_.Constraints(x.head(d), x.tail(d), &terms_);
    const int k = mode.Size();
    whitened_.resize(d, k);
    multiplier_.resize(k);
    int column = 0;
    for (int i : mode) {
      whitened_.col(column) = terms_.jacobian.row(i).transpose();
      Forward(factor_, whitened_.col(column));
      multiplier_(column) = -whitened_.col(column).dot(acceleration_) - terms_.bias(i);
      ++column;
    }
    gram_ = whitened_.transpose().lazyProduct(whitened_);
    Factor(&gram_);
    Forward(gram_, multiplier_);
    Backward(gram_, multiplier_);
    acceleration_ += whitened_.lazyProduct(multiplier_);
    column = 0;
    for (int i : mode) force_(i) = multiplier_(column++);
  }
  Backward(factor_, acceleration_);
}

}  // namespace adversary
}  // namespace contact_flow
