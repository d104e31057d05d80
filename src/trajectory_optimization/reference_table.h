// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/flow/input_schedule.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/trajectory_optimization/extended_reference.h"

namespace contact_flow {

/// The interval of the grid that begins at or before t, the first one before the grid.
std::size_t IntervalAt(const std::vector<double>& grid, double t);

/// Fills the table of a phase of the run: from `before` [s] ahead of its begin to `after` [s]
/// behind its end.
void TabulatePhase(const MechanicalSystem& system, const Trajectory& run,
                   const InputSchedule& inputs, double before, double after, ReferencePhase* phase);

}  // namespace contact_flow
