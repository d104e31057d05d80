// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// A plastic contact i that lands at a transition and is held, given a little restitution γ: it
/// bounces with the speed ε = γ |N v⁻|, and comes to rest by one more impact,
///   v_b = v⁺ + ε b,   τ = 2 ε/−N̈_f,   v₂ = R(v_b + τ a_f),
/// a_f and N̈_f being the accelerations without it and R the reset; bounces after that are of the
/// order ε². Returns (v₂ − v⁺ − τ a)/ε [d], a being the acceleration in the mode after: zero where
/// contacts stick, or slip, in both impacts as they do in that mode; to 1e-6 of b, from quotients
/// by τ and 2 τ. `bounce` is b [d]. Throws std::domain_error, or FrictionRefusal, where the mode
/// after is not that behind the bounce.
Vector BounceToRest(ContactDynamics* dynamics, const Transition& transition, int i,
                    const Vector& bounce);

}  // namespace contact_flow
