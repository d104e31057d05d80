// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <functional>

#include "contact_flow/types.h"

namespace contact_flow {

/// One step of DOP853 at a time: order 8, error estimate of orders 5 and 3, and on demand a
/// continuous extension of order 7 (Hairer, Nørsett, Wanner I, Sec. II.5, II.6). Autonomous systems
/// ẋ = F(x).
///
///   Begin(x) → TryStep(h) … until the error is ≤ 1 → Finish() → [Extend()] → Advance() → TryStep …
///
/// TryStep may be called again with another h from the same point: events are located by truncating
/// a step. Nothing allocates after construction. The field is called 11 times by TryStep, once by
/// Begin and by Finish, three times by Extend.
class Dop853 {
 public:
  /// Writes F(x) [n] to `xdot`; the k-th call since Begin or Advance is stage k.
  using Field = std::function<void(const double* x, double* xdot)>;

  Dop853(int n, Field field);

  /// Sets the point from which steps start.
  void Begin(const Vector& x);
  /// A first guess for h [s] (Hairer, Nørsett, Wanner I, Sec. II.4); one call of the field.
  double GuessStep(double relative_tolerance, double absolute_tolerance);
  /// Computes the end of a step of length h; returns the scaled error, acceptable when ≤ 1.
  double TryStep(double h, double relative_tolerance, double absolute_tolerance);
  /// The estimated errors at the end of the step tried last, absolute [n].
  auto LocalErrors() const { return error_factor_ * errors_.array().abs(); }
  /// Evaluates the field at the end, which the caller may first move by an amount of the order of
  /// the error.
  void Finish();
  Vector* mutable_end() { return &x_end_; }
  /// Computes the continuous extension of the finished step.
  void Extend();
  bool extended() const { return extended_; }
  /// x(t₀ + θ h) [n] from the continuous extension.
  void Interpolate(double theta, double* x) const;
  /// The coefficients of the extension [kDenseOrder×n], see EvaluateDenseStep.
  const double* dense() const { return dense_.data(); }
  /// The end of the step becomes the beginning of the next.
  void Advance();

  double step() const { return h_; }
  const Vector& begin() const { return x_; }
  const Vector& end() const { return x_end_; }
  Eigen::Map<const Vector> begin_field() const { return {stage(0), n_}; }
  Eigen::Map<const Vector> end_field() const { return {stage(12), n_}; }

 private:
  double* stage(int k) { return stages_.data() + k * n_; }
  const double* stage(int k) const { return stages_.data() + k * n_; }
  template <int J>
  void Combine(double* out) const;
  template <int J>
  void EvaluateStage();

  const int n_;
  const Field field_;
  double h_ = 0;
  double error_factor_ = 0;
  bool extended_ = false;
  Vector x_;
  Vector x_end_;
  Vector scratch_;
  Vector stages_;  // 16 derivatives, contiguous
  Vector dense_;
  Vector errors_;  // of order 5, to be scaled by error_factor_
};

}  // namespace contact_flow
