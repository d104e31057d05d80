// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// Velocities along a run that are rates of clocks, ascending: nothing changes them, whatever the
/// state, and the motion depends on their coordinates. They are what they are: no start of another
/// run has others. Coordinates that nothing depends on are places, and their rates may differ.
std::vector<int> ClockRates(const MechanicalSystem& system, const Trajectory& run);

/// Unit rows [·×2d] of these velocities.
Matrix RateRows(const std::vector<int>& velocities, int dof);

/// Orthonormal basis of what a basis [2d×·] spans and these rows leave as it is.
Matrix Keeping(const Matrix& basis, const Matrix& rows);

}  // namespace contact_flow
