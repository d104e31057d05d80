// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/constraint_set.h"
#include "contact_flow/derivative/cluster_class.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "impact_sequences.h"
#include "touching_frame.h"

namespace contact_flow {

/// Contacts that touch without force (Transition::touching) share an impact all at once. Where one
/// of them touches a little later it is hit by what is hit before it. Compares where both lead, for
/// each subset of `open` that does not touch yet: false where v⁺ is another, or where that is not
/// known; then class, status and outcomes of the report say so.
bool JudgeTouching(ContactDynamics* dynamics, const Transition& transition,
                   const TouchingFrame& frame, ConstraintSet open, SequenceRules rules,
                   ClusterReport* report);

/// kOk where every perturbed run touches, too: Da_i w_q + ∂a_i/∂p δp = 0 and D(Da_i v) w = 0 for
/// the columns w of `tangents` [2d+k × ·] at x⁻. Else whether a perturbed run touches when the
/// impact or the force comes depends on the direction, and on orders that are not followed.
Status CheckTouching(ContactDynamics* dynamics, const Transition& transition,
                     const Matrix& tangents);

}  // namespace contact_flow
