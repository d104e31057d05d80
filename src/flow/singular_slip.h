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

/// Where forces vary so quickly that no step resolves them, at (t, x): the same; or a contact whose
/// force pulls by now lets go; or a slip that is not told from rest ends; or forces have passed
/// their bounds within the last step. Nothing where none fits.
std::optional<ResolvedTransition> ResolveUnresolvedSlip(ContactDynamics* dynamics, double t,
                                                        const Vector& x, ContactMode mode,
                                                        const TransitionRules& rules);

/// Where det(A_J M⁻¹ W_J) of a slipping mode passes zero at (t, x) more than one motion fits from
/// here on: slip, which no contact that gives way a little follows; an impact that ends it; and
/// the contact that lets go. The limit of contacts ever stiffer is the impact, which is followed;
/// the contact lets go where there is none. The same warning; kPainleveCrossing where neither fits.
ResolvedTransition ResolveSingularSlip(ContactDynamics* dynamics, double t, const Vector& x,
                                       ContactMode mode, const TransitionRules& rules);

}  // namespace contact_flow
