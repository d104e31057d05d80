// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "contact_flow/flow/dense_step.h"
#include "contact_flow/flow/stage_places.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// One step of an integrator of autonomous systems ẋ = F(x) at a time, with dense output:
///
///   Begin(x) → TryStep(h) … until the error is ≤ 1 → Finish() → [Extend()] → Advance() → TryStep …
///
/// TryStep may be called again with another h from the same point: events are located by truncating
/// a step. What it gives depends on the point, on the steps before and on the calls of TryStep
/// since Begin, Advance or Restart, on nothing else. Nothing allocates after the first step.
class Stepper {
 public:
  Stepper(const Stepper&) = delete;
  Stepper& operator=(const Stepper&) = delete;
  virtual ~Stepper() = default;

  /// Sets the point from which steps start.
  virtual void Begin(const Vector& x) = 0;
  /// A first guess for h [s].
  virtual double GuessStep(double relative_tolerance, double absolute_tolerance) = 0;
  /// Computes the end of a step of length h; returns the scaled error, acceptable when ≤ 1. A
  /// step that fails altogether has a large error, and an end that is not finite.
  virtual double TryStep(double h, double relative_tolerance, double absolute_tolerance) = 0;
  /// Evaluates the field at the end, which the caller may first move by an amount of the order of
  /// the error.
  virtual void Finish() = 0;
  /// Computes the continuous extension of the finished step.
  virtual void Extend() = 0;
  /// The end of the step becomes the beginning of the next.
  virtual void Advance() = 0;
  /// Forgets the steps tried from this point.
  virtual void Restart() {}
  /// What the next step may be longer by after one with this error.
  virtual double Growth(double error) const { return std::pow(std::max(error, 1e-30), exponent_); }

  /// −1/p, where errors of steps grow with h^p.
  double exponent() const { return exponent_; }
  /// Where a step knows the field: what guards may be sampled at for nothing.
  const StagePlaces& places() const { return *places_; }
  /// The estimated errors of the step tried last, absolute [n].
  auto LocalErrors() const { return error_factor_ * errors_.array().abs(); }
  Vector* mutable_end() { return &x_end_; }
  bool extended() const { return extended_; }
  /// x(t₀ + θ h) [n] from the continuous extension.
  void Interpolate(double theta, double* x) const {
    EvaluateDenseStep(dense_.data(), n_, theta, x);
  }
  /// The coefficients of the extension [kDenseOrder×n], see EvaluateDenseStep.
  const double* dense() const { return dense_.data(); }

  double step() const { return h_; }
  const Vector& begin() const { return x_; }
  const Vector& end() const { return x_end_; }
  Eigen::Map<const Vector> begin_field() const { return {begin_field_, n_}; }
  Eigen::Map<const Vector> end_field() const { return {end_field_, n_}; }

 protected:
  Stepper(int n, double exponent, const StagePlaces& places)
      : n_(n),
        exponent_(exponent),
        places_(&places),
        x_(n),
        x_end_(n),
        dense_(kDenseOrder * n),
        errors_(n) {}

  const int n_;
  const double exponent_;
  const StagePlaces* const places_;
  const double* begin_field_ = nullptr;
  const double* end_field_ = nullptr;
  double h_ = 0;
  double error_factor_ = 0;
  bool extended_ = false;
  Vector x_;
  Vector x_end_;
  Vector dense_;
  Vector errors_;  // to be scaled by error_factor_
};

}  // namespace contact_flow
