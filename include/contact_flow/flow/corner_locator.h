// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "contact_flow/flow/corner_functions.h"
#include "contact_flow/flow/stepper.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Finds where in a step of the integrator one of the CornerFunctions first passes a corner. The
/// field is continuous there: what is not found (a limit that is exceeded for a part of the step)
/// is left to the error control of the step. A corner that is touched is not passed.
class CornerLocator {
 public:
  explicit CornerLocator(const MechanicalSystem& system);

  bool HasCorners() const { return !functions_.Empty(); }
  /// From x to the next knot of a function of time [s], at which a step ends; else infinity.
  double TimeToKnot(const Vector& x) const { return functions_.TimeToKnot(x); }
  /// A zero of r − corner, r one of the functions, at θ of the step.
  struct Zero {
    int function = 0;
    double corner = 0;
    double theta = 1;
  };
  /// The earliest one in the finished step, if any.
  std::optional<Zero> Locate(Stepper* stepper, const VectorRef& u, ContactMode mode);
  /// r − corner at the end of the step, and its rate there [1/s].
  double AtEnd(const Stepper& stepper, const Zero& zero, const VectorRef& u, ContactMode mode,
               double* rate);

 private:
  static constexpr int kSamples = 5;

  void Evaluate(const Vector& x, Vector* value) { functions_.Evaluate(x, u_, mode_, value); }
  /// r at the beginning or end of the step into `value`, and its rates times the step.
  void ValuesAndRates(const Vector& x, const VectorRef& xdot, double h, Vector* value,
                      Vector* rate);
  bool MayPass() const;
  double Turn(int i, int j) const;
  std::optional<Zero> FirstZero(Stepper* stepper, int i);
  double ValueAt(Stepper* stepper, int i, double theta);
  double Root(Stepper* stepper, int i, double corner, double begin, double end);

  const CornerFunctions functions_;
  Vector u_;
  ContactMode mode_;
  Vector x_, value_, moved_;
  Vector begin_, begin_rate_, end_, end_rate_;
  Matrix samples_;  // [functions × kSamples]
};

}  // namespace contact_flow
