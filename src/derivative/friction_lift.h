// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Whether no forces of the contacts that stick at x in `mode`, anywhere in their friction cones
/// (octagons around them in space), take the normal force from any contact of the mode: by linear
/// programs, false without them. Then CheckStops passes for every w.
bool NoFrictionLifts(ContactDynamics* dynamics, const Vector& x, ContactMode mode);

}  // namespace contact_flow
