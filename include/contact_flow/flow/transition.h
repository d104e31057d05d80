// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// How a cluster of events is resolved.
struct TransitionRules {
  double simultaneity_tolerance;  ///< [s]
  double speed_tolerance;         ///< [m/s]
  ImpactLaw impact_law;
  double relative_tolerance = 1e-9, absolute_tolerance = 1e-9;  ///< of the integration
};

/// A transition with what it adds to the margins, and a status that is not kOk where it is
/// inadmissible.
struct ResolvedTransition {
  Transition transition;
  double approach_speed;  ///< min |Da_i v⁻| over activations, or +∞ [m/s]
  double release_rate;    ///< min |dλ_i/dt| over releases by vanishing force, or +∞ [N/s]
  Status status;
};

/// Resolves the events at (ρ, v⁻) = x in mode J⁻, `trigger` being the one that was located: every
/// other guard that vanishes within the simultaneity tolerance on the present motion belongs to the
/// cluster.
///   I_a = {i ∉ J⁻ : a_i = 0, Da_i v⁻ < 0} and J⁻ share an impact (1b); what rests after it is a
///   candidate for J⁺ by force complementarity. Without activations the state is continuous and J⁺
///   = J⁻ minus the releases.
/// Compliant constraints change sides where their gap vanishes. Where the effort depends on the
/// mode, J⁺ must agree with its own effort, or the status is kFilippov. Grazing (Da_i v⁻ = 0 at the
/// trigger, within tolerance) is inadmissible: the state is left as it is.
ResolvedTransition ResolveTransition(ContactDynamics* dynamics, double t, const Vector& x,
                                     ContactMode mode, int trigger, const TransitionRules& rules);

/// The next input begins at (t, x), `dynamics` having it already: what rests stays in contact
/// unless it would have to pull now.
ResolvedTransition ResolveInputChange(ContactDynamics* dynamics, double t, const Vector& x,
                                      ContactMode mode);

}  // namespace contact_flow
