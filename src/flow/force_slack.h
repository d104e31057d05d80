// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// What inequalities of accelerations may miss at a transition with friction, by constraint [n]:
/// G_ii (2|h| + |ḣ| ε) for each guard h of forces that is zero there, as located to ε in time, in
/// the units of its gap's acceleration [m/s²]; for a cone also over μ, as λ_n is its h over μ.
/// Zero elsewhere.
Vector ForceSlack(ContactDynamics* dynamics, const Transition& transition);

/// The largest acceleration at x of the rows of `touching` without their forces, to which the
/// inequalities of words are relative.
double LargestAcceleration(const ContactDynamics& dynamics, const Vector& x,
                           const ConstraintSet& touching);

}  // namespace contact_flow
