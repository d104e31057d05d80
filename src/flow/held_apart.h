// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/flow/transition.h"

namespace contact_flow {

/// Contacts stick on rows that depend on each other, and the motion moves these apart: wheels that
/// roll side by side, one of which is steered. No velocity keeps all of them, so they are given
/// letters again: one begins to slip. There is no derivative across it, as which one it is may not
/// be that of a perturbed run. `apart` are those whose rates cannot be held at (t, x).
ResolvedTransition ResolveHeldApart(ContactDynamics* dynamics, double t, const Vector& x,
                                    ContactMode mode, ConstraintSet apart,
                                    const TransitionRules& rules);

}  // namespace contact_flow
