// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "test/adversary/random_system.h"

namespace contact_flow {
namespace adversary {

/// (q, v), without the heap.
using SmallState = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 2 * kMaxDof, 1>;

/// Acceleration and contact forces of a random system in one contact mode, by Cholesky factors of M
/// and of A M⁻¹ Aᵀ. Nearly all the time of a reference run is spent here: no heap, plain loops.
class ReferenceDynamics {
 public:
  explicit ReferenceDynamics(const RandomSystem& system) : system_(system) {}

  /// At x = (q, v) [2d], contacts of `mode` kept.
  void Solve(const VectorRef& x, const Vector& u, ConstraintSet mode);

  const SmallVector& acceleration() const { return acceleration_; }  ///< [d]
  const SmallVector& force() const { return force_; }                ///< [n], zero off the mode
  /// Of the last call: M [d×d].
  const Matrix& mass() const { return mass_; }

 private:
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxDof, kMaxDof>;
  /// The lower factor L of S = L Lᵀ, in place; dependent rows get no part of a solution.
  static void Factor(Small* S);
  /// y ← L⁻¹ y.
  static void Forward(const Small& L, Eigen::Ref<SmallVector> y);
  /// y ← L⁻ᵀ y.
  static void Backward(const Small& L, Eigen::Ref<SmallVector> y);

  const RandomSystem& system_;
  SmallVector acceleration_, force_, multiplier_;
  Matrix mass_;
  Vector applied_;
  ConstraintTerms terms_;
  Small factor_, whitened_, gram_;
};

}  // namespace adversary
}  // namespace contact_flow
