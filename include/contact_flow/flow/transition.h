// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/flow/closed_gaps.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// How a cluster of events is resolved.
struct TransitionRules {
  double simultaneity_tolerance;  ///< [s]; 0: what state_error leaves of the instants
  double speed_tolerance;         ///< [m/s]
  ImpactLaw impact_law;
  double gap_tolerance = 1e-9;    ///< touching without force [m]
  double reach_tolerance = 1e-9;  ///< heights that the integrator does not resolve [m]
  /// The same event came again at the same time: decide it the other way.
  bool stalled = false;
  double relative_tolerance = 1e-9, absolute_tolerance = 1e-9;  ///< of the integration
  /// Estimated errors of the state, (e_q, e_v) [2d], of which an event has the error
  /// |Dg| e / |dg/dt| in its instant, g being its guard; empty: none.
  Vector state_error;
  /// Constraints that the mode holds, their rows being combinations of its own: they touch all
  /// along, and what rate they have is rounding. Without friction.
  ConstraintSet implied;
  /// Of gaps that are known better, having been closed shortly before. With friction; null: none.
  const ClosedGaps* closed = nullptr;
};

/// A transition with what it adds to the margins, and a status that is not kOk where it
/// is inadmissible.
struct ResolvedTransition {
  Transition transition;
  double approach_speed;  ///< min |Da_i v⁻| over activations, or +∞ [m/s]
  double release_rate;    ///< min |dλ_i/dt| over releases by vanishing force, or +∞ [N/s]
  /// The largest speed at which a contact would have risen that was made rest [m/s], and the time
  /// until it would have been back [s].
  double rest_speed = 0, rest_interval = 0;
  /// Those that would rise at more than rounding, however slowly, and for how long at most [s].
  ConstraintSet held_down;
  double held_interval = 0;
  Status status;
  std::vector<Warning> warnings;
};

/// Resolves the events at (ρ, v⁻) = x in mode J⁻, `trigger` being the one that was located: every
/// other guard that vanishes within the simultaneity tolerance on the present motion belongs to the
/// cluster; without one, every other that vanishes within kInstantErrors times the errors
/// of both instants, of gaps those that are no higher than their own errors and a tolerance.
///   I_a = {i ∉ J⁻ : a_i = 0, Da_i v⁻ < 0} and J⁻ share an impact (1b), together with every other
/// rigid constraint that touches, a_i = Da_i v⁻ = 0, with or without force: all at once, the
/// simultaneous law of Newton and Moreau. For balls in a row, the first of which hits elastically,
/// that gives (−1/3, 2/3, 2/3) whether they touch or are pressed, where impacts one after another
/// would give (0, 0, 1): the outcome is not continuous there. What rests after the impact is a
/// candidate for J⁺ by force complementarity. Without activations the state is continuous, and J⁺
/// = J⁻ minus the releases: those of several forces that vanish at once are decided together by
/// their rates (SelectMode).
/// Compliant constraints change sides where their gap vanishes. Where the effort depends on the
/// mode, J⁺ must agree with its own effort, or the status is kFilippov.
/// Where the trigger's slope vanishes within tolerance (grazing; or a rise so low that it is not
/// resolved, v²/(2|ä|) ≤ 4 reach_tolerance), the motion goes on: a speed into the contact is an
/// impact like any other, what then stands still is a candidate for J⁺, held if pressed and off if
/// not. It is in Transition::grazed, with a warning.
ResolvedTransition ResolveTransition(ContactDynamics* dynamics, double t, const Vector& x,
                                     ContactMode mode, int trigger, const TransitionRules& rules);

/// The same with friction, `trigger` being one of Guards:
///   - what approaches shares a frictional impact (F6) with all that touches;
///   - what rests in normal direction gets letters by (F4): contacts without slip, among them those
///     whose slip has come to an end, as free to slip either way, the others in their direction;
///   - what rests, and what sticks, is made rest by the shortest change of velocity.
/// Words with equality are decided by what holds a moment later (SelectWord).
ResolvedTransition ResolveFriction(ContactDynamics* dynamics, double t, const Vector& x,
                                   ContactMode mode, int trigger, const TransitionRules& rules);
/// Where the next input begins.
ResolvedTransition ResolveFrictionalInput(ContactDynamics* dynamics, double t, const Vector& x,
                                          ContactMode mode, const TransitionRules& rules);

/// The next input begins at (t, x), `dynamics` having it already: what rests or touches without
/// force stays in contact unless it would have to pull now.
ResolvedTransition ResolveInputChange(ContactDynamics* dynamics, double t, const Vector& x,
                                      ContactMode mode, const TransitionRules& rules);

}  // namespace contact_flow
