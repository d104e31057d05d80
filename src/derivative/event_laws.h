// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/derivative/event_map.h"
#include "contact_flow/derivative/trust.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// What is left of the law of events: B(F⁻) − F⁺, and the size of the fields [2d+k].
struct EventResidual {
  Vector value;
  double size = 0;
};

/// Holds one transition and its map to the laws of events in Trust, whose entries grow to the
/// largest residuals so far. `before` and `after` are scratch with the inputs of the arcs on either
/// side. `residual` is zero where the input changes. Not kOk, with the law's name, time and size,
/// where one fails. Costs one direction of the map, a factorization, and m saltation matrices for
/// each face that is compared.
Status CheckEventLaws(ContactDynamics* before, ContactDynamics* after, const Transition& transition,
                      const EventMap& map, Trust* trust, EventResidual* residual);

}  // namespace contact_flow
