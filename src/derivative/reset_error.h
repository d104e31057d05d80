// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Samples of the error of a state, as tangents, whose mean square counts.
inline constexpr int kProbes = 4;
using Probes = std::array<Vector, kProbes>;

/// The part of what a transition behind `arc` changes in tangents that errors of the state leave
/// unknown: by its speeds of approach, and by slips in space that end a little early, or that
/// bounces made rest may have turned.
double RelativeResetError(ContactDynamics* dynamics, const Arc& arc, const Transition& transition,
                          const Probes& errors);

}  // namespace contact_flow
