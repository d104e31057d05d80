// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/analysis/return_section.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// The first crossing of a section of the state, kCoordinate or kVelocity, along a dense run from
/// the time `from` on, to the accuracy of the dense output; false where there is none. Each step is
/// looked at in 16 parts; one that turns inside a part is followed to its turn, so that two
/// crossings in one part are both seen. A number that does not jump at an event is followed across
/// it; a jump of the sign at an impact is no crossing.
bool FirstCrossing(const MechanicalSystem& system, const Section& section, const Trajectory& run,
                   double from, double* time);

}  // namespace contact_flow
