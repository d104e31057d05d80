// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mode_selection.h"

namespace contact_flow {

/// The one mode J ⊆ candidates, with `pressed`, whose effort f(q, v, u, J) gives forces and
/// accelerations that J says: λ > 0 in it, ä > 0 out of it, what vanishes by its rate. Every subset
/// is tried. Throws UndecidedMode where none fits, several do, or there are too many.
ContactMode SelectByEffort(ContactDynamics* dynamics, const VectorRef& x,
                           const ConstraintSet& candidates, const ForceTolerance& tolerance,
                           const ConstraintSet& pressed);

}  // namespace contact_flow
