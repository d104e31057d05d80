// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// Not kOk where, as far as the instants are known, an event falls on the end T of the run. By an
/// impact x(T) jumps by v⁺ − v⁻ between the perturbed runs that meet it before T and those that do
/// not; by a stop or a reversal of a slip, a spring that is met or a knot of a reference F jumps,
/// and its slopes are those by F⁻ on the one side and by F⁺ on the other. With the estimated error
/// of x(T) as a tangent [2d]. Knots of references, DrivenSwitches, are put into `switches` instead
/// where that is asked for: they come as they did in all runs whose clock is not moved.
Status CheckEnd(const MechanicalSystem& system, const Trajectory& run, const Vector& state_error,
                ConstraintSet* switches = nullptr);
/// Of such a switch at the end: the tangents w with side·w ≥ 0, by `ahead` [s] before the end,
/// leave it on the side on which the run ends [2d+k].
Vector SideOfSwitch(const MechanicalSystem& system, const Trajectory& run,
                    const Variables& variables, double ahead, int constraint);

}  // namespace contact_flow
