// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"

namespace contact_flow {

/// The errors of an outcome x(T) and of its derivative B, measured: the run is made and
/// differentiated once more with a small part of its tolerances and shorter steps in each arc; what
/// differs is the error of the first. It costs a few such runs: up to eight times as many steps are
/// made where some arcs are much shorter than others. Trust and BDerivative::Error cost nearly
/// nothing, and may be a thousand times as large. Where tolerances cannot be smaller the other run
/// has larger ones, and errors are less than what differs.
class MeasuredErrors {
 public:
  /// Of Simulate(system, x, input, duration, options) and DifferentiateOutcome of it, whose status
  /// is kOk; system, trajectory and derivative must outlive this.
  MeasuredErrors(const MechanicalSystem& system, const VectorRef& x, const InputSchedule& input,
                 double duration, const SimulateOptions& options, const Trajectory& trajectory,
                 const BDerivative& derivative);

  /// Estimated error of x(T), as a tangent [2d].
  Vector OfState() const;
  /// Estimated error of B(w) [2d].
  Vector Along(const VectorRef& w) const;
  /// kOk where the other run comes out as the first; else how it does not. Where it has an outcome,
  /// or a derivative, what differs is the error all the same; else errors are those of Trust and
  /// BDerivative::Error.
  const Status& status() const { return status_; }

 private:
  const MechanicalSystem& system_;
  const Trajectory& trajectory_;
  const BDerivative& derivative_;
  double safety_;
  Trajectory other_trajectory_;
  BDerivative other_derivative_;
  Status status_;
};

}  // namespace contact_flow
