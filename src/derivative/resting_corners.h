// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// Not kOk where the motion stays on a corner of f throughout a step of the arc (CornerFunctions:
/// an effort at its limit, a place at the knot of its surface), and DF by the variables of
/// `dynamics` differs on its two sides: perturbed runs are on one of them each.
Status CheckRestingCorners(const ContactDynamics& dynamics, const Arc& arc);

}  // namespace contact_flow
