// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "arc_checks.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// Not kOk where a contact touches all along an arc, or a step of it where f has corners,
/// and nothing presses it or lifts it, as after a landing under a force that just bears the weight
/// or reaches its limit there, whether the mode holds it or not; and its force, if it is held,
/// depends to first order on the variables of `dynamics`, or on state that the contact leaves free:
/// of perturbed runs some lift off, and others are held.
Status CheckIdleContacts(ContactDynamics* dynamics, const Arc& arc, const ArcInRun& in_run);

}  // namespace contact_flow
