// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Sizes of the entries of w = (δq, δv, δu, δp) [2d+k] that count alike in any units, at x on the
/// motion of a mode: of a velocity 1/√M_ii, of a coordinate as much as that makes in the time in
/// which the acceleration would make the velocity, and of variables what changes accelerations in
/// that time, gaps or rates of rows by as much.
Vector TangentSizes(ContactDynamics* dynamics, const Vector& x, ContactMode mode);

}  // namespace contact_flow
