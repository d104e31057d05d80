// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "contact_flow/flow/transition.h"

namespace contact_flow {

/// Ends a slip at (t, x) by an impact without collision (SolveTangentialImpact): of the contact
/// that presses most and jams. There is no derivative across it, and a warning tells of it. Nothing
/// where no slip does.
std::optional<ResolvedTransition> ResolveJam(ContactDynamics* dynamics, double t, const Vector& x,
                                             ContactMode mode, const TransitionRules& rules);

/// Where det(A_J M⁻¹ W_J) of a slipping mode passes zero at (t, x) more than one motion fits from
/// here on. What slips lets go, if it rises then: no velocity jumps. Else its slip ends by an
/// impact. The same warning; kPainleveCrossing where neither is possible.
ResolvedTransition ResolveSingularSlip(ContactDynamics* dynamics, double t, const Vector& x,
                                       ContactMode mode, const TransitionRules& rules);

}  // namespace contact_flow
