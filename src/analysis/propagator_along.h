// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/derivative/variation.h"

namespace contact_flow {

/// Propagators from the beginning of an arc to instants in it, which do not fall: from each to the
/// next, as from the beginning each time many of them would take their square in time.
class PropagatorAlong {
 public:
  /// See PropagateArc. The dynamics are scratch, and those of the arc's input.
  PropagatorAlong(ContactDynamics* dynamics, const Arc& arc, double tolerance)
      : dynamics_(*dynamics), piece_(arc), tolerance_(tolerance) {}

  /// Φ(t) [2d+k × 2d+k].
  const Matrix& To(double t) {
    piece_.t_end = t;
    piece_.dense.Evaluate(t, piece_.x_end.data());
    const Matrix onward = PropagateArc(&dynamics_, piece_, tolerance_);
    propagator_ = propagator_.size() > 0 ? (onward * propagator_).eval() : onward;
    piece_.t_begin = t;
    piece_.x_begin = piece_.x_end;
    return propagator_;
  }
  /// The state there.
  const Vector& x() const { return piece_.x_begin; }

 private:
  ContactDynamics& dynamics_;
  Arc piece_;
  const double tolerance_;
  Matrix propagator_;
};

}  // namespace contact_flow
