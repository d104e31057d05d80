// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>

#include "contact_flow/contact_mode.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Those of `near` whose rows N depend on those of `closed` at x: what closes these closes them.
ConstraintSet ImpliedClosed(const MechanicalSystem& system, const Vector& x,
                            const ConstraintSet& closed, const ConstraintSet& near);

/// Those of `closed` that cannot slip as long as `still` do not: their rows T depend on N of all
/// that is closed and on T of what is still.
ConstraintSet ImpliedStill(const MechanicalSystem& system, const Vector& x,
                           const ConstraintSet& closed, const ConstraintSet& still);

/// What rests is made rest, by the shortest change of velocity: normal velocities of the mode,
/// slips of what sticks. A slip in space that begins gets its direction by `onsets` [m/s], which
/// count as none; in the mean, where the slips of one body cannot be these.
void MakeRest(const MechanicalSystem& system, const ContactMode& mode,
              const std::map<int, Eigen::Vector2d>& onsets, Vector* x);

}  // namespace contact_flow
