// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/analysis/poincare.h"
#include "contact_flow/derivative/b_derivative.h"

namespace contact_flow {

/// Where a wanted event happens in a run.
struct EventPlace {
  int transition = -1;  ///< −1: it does not
  WantedEvent event;
};

/// Whether a transition holds such a touchdown or lift-off, whichever occurrence it is. A compliant
/// constraint touches down where its gap falls through zero.
bool Happens(const Transition& transition, const WantedEvent& event);
/// "touchdown number 1 of 'left_foot'".
std::string EventName(const MechanicalSystem& system, const WantedEvent& event);

std::vector<EventPlace> LocateEvents(const Trajectory& run, const std::vector<WantedEvent>& events);
/// NaN for those that do not happen.
Vector EventTimes(const Trajectory& run, const std::vector<EventPlace>& events);

/// B as a map of (δq, δv, δu, δp) to itself, the variables carried along, and below it a row for
/// each event: the first-order change of its time [2d+k+e × 2d+k],
///   −Da_i w / (Da_i v) along the order of a cluster,  −Dλ_i w / (dλ_i/dt) for a release.
/// `first` is what the start and the first arc make of directions [2d+k × 2d+k].
/// Throws std::domain_error for an event that does not happen, or a release
/// together with an impact.
PiecewiseLinearMap TangentMap(const BDerivative& B, const PiecewiseLinearMap& first,
                              const std::vector<EventPlace>& events, const MechanicalSystem& system,
                              const Trajectory& run);

/// (w, s) ↦ (f(w), s) for `more` numbers s.
PiecewiseLinearMap WithIdentity(const PiecewiseLinearMap& map, int more);

/// Gradient of the gap a_i by (δq, δv, δu, δp) [2d+k] at x.
Vector GapGradient(const MechanicalSystem& system, const VectorRef& x, int i,
                   const Variables& variables);

}  // namespace contact_flow
