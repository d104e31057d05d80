// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/types.h"

namespace contact_flow {

/// The law that a propagator must obey, whatever the forces: a shift in time is a tangent that the
/// flow carries along,
///   Φ F(x(t₀)) = F(x(t₁)),   F = (v, v̇)
/// (alike in (δq, δv) and in (y, ẏ), since ad_v v = 0). It sees what tangents have missed and the
/// state has not, and what the state has missed and the tangents have not. An error of Φ of ε times
/// its largest entry makes a residual of at most ε in the units below.
class FlowLaw {
 public:
  /// Errors of the state of about `tolerance` are not the tangents' fault.
  explicit FlowLaw(double tolerance) : tolerance_(tolerance), noise_(tolerance) {}

  /// Begins an arc with F there [2d], the sum of terms of about the size `terms`.
  void Begin(const VectorRef& field, double terms);
  /// Residual of a step: |step F₀ − F₁|, relative to `size`, the largest entry of the propagator so
  /// far, and to the size of F at the beginning of the arc.
  double Residual(const Matrix& step, const VectorRef& before, const VectorRef& after, double size);
  /// The same of the vector step F₀.
  double Residual(const VectorRef& carried, const VectorRef& after, double size);
  /// Whether the last residual is within the tolerance, or what errors of the state make of it
  /// where [K D] is `jacobian`: stiffness turns them into accelerations. `state` is its size.
  bool Holds(const MatrixRef& jacobian, double state);
  /// The same residual remained in a shorter step: the state is to blame.
  void Excuse();
  /// Takes over the last residual.
  void Accept() { total_ += last_; }

  /// Of the last residual, accepted by Holds, step F₀ − F₁ [2d], but for the part that errors of
  /// the state of the tolerance explain.
  Vector Defect() const;
  /// The size of F at the beginning of the arc.
  double size() const { return size_; }
  /// Σ of the residuals accepted.
  double total() const { return total_; }
  /// The error of the state that explains them.
  double noise() const { return noise_; }

 private:
  double Note(double size);

  const double tolerance_;
  double noise_;
  double size_ = 0, rounding_ = 0;
  double last_ = 0;
  double per_noise_ = 0;  // residual that an error of the state of 1 makes in the last step
  double total_ = 0;
  Vector difference_;
};

}  // namespace contact_flow
