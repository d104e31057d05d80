// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// Not kOk where, as far as the instants are known, an impact falls on the end T of the run: x(T)
/// jumps by v⁺ − v⁻ between the perturbed runs that meet it before T and those that do not. With
/// the estimated error of x(T) as a tangent [2d].
Status CheckEnd(const MechanicalSystem& system, const Trajectory& run, const Vector& state_error);

}  // namespace contact_flow
