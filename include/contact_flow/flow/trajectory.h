// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/flow/dense_step.h"
#include "contact_flow/flow/integration_method.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A maximal interval (t_begin, t_end] of motion in one contact mode.
struct Arc {
  ContactMode mode;    ///< contact mode J
  Vector u;            ///< input [m]
  double t_begin = 0;  ///< [s]
  double t_end = 0;    ///< [s]
  Vector x_begin;      ///< right limit at t_begin [nq+d]
  Vector x_end;        ///< left limit at t_end [nq+d]
  DenseArc dense;      ///< the motion in between; empty unless SimulateOptions::dense
  /// What the estimated local errors of the arc's steps add up to, as a tangent (δq, δv)
  /// [2d]; see ErrorTally.
  Vector error;
  long implicit_steps = 0;  ///< of its steps, those made by the implicit method
};

/// When one event of a cluster happens on the motion before it.
struct EventInstant {
  int constraint = 0;  ///< its index
  double offset = 0;   ///< after the transition, by its guard and rate there [s]
  double error = 0;    ///< estimated error of the instant, by the integrator's local errors [s]
};

/// Events count as simultaneous within this many times the estimated errors of their instants,
/// unless SimulateOptions::simultaneity_tolerance says otherwise.
inline constexpr double kInstantErrors = 4;

/// What happens at one instant between two arcs: a cluster of simultaneous
/// activations and releases.
struct Transition {
  double t = 0;             ///< [s]
  Vector x_minus;           ///< (ρ, v⁻) [nq+d]
  Vector x_plus;            ///< (ρ, v⁺) [nq+d]
  ContactMode mode_before;  ///< J⁻
  ContactMode mode_after;   ///< J⁺
  ConstraintSet activated;  ///< I_a: a_i = 0 with Da_i v⁻ < 0, whether it then holds or bounces
  ConstraintSet released;   ///< members of J⁻ that are not in J⁺
  ConstraintSet vanishing;  ///< I_d: members of J⁻ whose force passes zero here
  ConstraintSet switched;   ///< compliant constraints whose gap passes zero, either way
  Vector
      impulse;  ///< p, then that of the bilateral constraints [n+l], [N·s] (zero where no impact)
  double spread = 0;  ///< time between the first and the last event of the cluster [s]
  std::vector<EventInstant> instants;  ///< of its events, by constraint
  /// With friction: the Guards of mode_before that vanish here, in the order of their instants,
  /// beside the letters of the impulses.
  std::vector<int> guards;
  ContactMode impulse_word;  ///< the letters of the impulses, with friction
  double energy_change = 0;  ///< of the frictional impact [J]
  double tolerance = 0;  ///< within which events counted as simultaneous with the first located [s]
  /// Touched with vanishing speed, or about to let go with dλ/dt = 0: no derivative across it.
  ConstraintSet grazed;
  /// Rigid constraints beyond J⁻ and I_a that touched without force, a_i = Da_i v⁻ = 0, and were
  /// hit, or are pressed from here on: the outcome is not continuous here.
  ConstraintSet touching;
  /// Touching constraints that J⁺ implies, their rows of Da being dependent on its rows: how a
  /// force is shared among them is not unique, the motion is.
  ConstraintSet implied;
  /// Infinitely many bounces were completed to sticking here (SimulateOptions::complete_zeno), or
  /// bounces too low to be resolved.
  bool completes_zeno = false;
  double energy_lost = 0;  ///< kinetic energy that making small speeds rest took here [J]
  /// With friction: the mode that contacts come to rest in which the impact would throw up, to be
  /// pressed back at once; empty where there are none, or where how they bounce may decide.
  ContactMode rested;
  /// What brings them to rest, in the sum of all bounces, beside `impulse` [n+l+r], or empty.
  Vector rest_impulse;
  /// By how much slips in space turn meanwhile, at most [rad]: that part of what it
  /// changes is not known.
  double turned = 0;
  /// How far the state may be from where bounces that are made rest leave it [2d]: positions by
  /// half of what rest changes of v, over the time that these bounces would take; v by all of it
  /// where the force of one that bounces vanishes meanwhile. Empty where there are none.
  Vector rest_error;
  /// The part of v⁺ with which slips in space begin, to have a direction [d], or empty.
  Vector begun;
  /// Not kOk: why there is no derivative across this transition, whatever the rest of it is like.
  Status obstacle;
  /// The input changes here, at an instant of its grid, and contacts that would
  /// have to pull let go.
  bool changes_input = false;
  ImpactLaw impact_law = ImpactLaw::kComplementarity;  ///< by which it was resolved
  /// Of the integration that led here, as in SimulateOptions.
  double relative_tolerance = 1e-9;
  double absolute_tolerance = 1e-9;  ///< as relative_tolerance
};

/// How close the run came to an event that did not happen, or to one that happened badly.
/// Infinite where nothing of the kind occurred.
struct Margins {
  /// Where nothing came near.
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  double approach_speed = kNone;  ///< min |Da_i v⁻| over activations [m/s]
  double release_rate = kNone;    ///< min |dλ_i/dt| over releases [N/s]
  double gap = kNone;             ///< smallest interior minimum of a gap that stayed open [m]
  double force = kNone;           ///< smallest interior minimum of a force that kept pushing [N]
  double event_interval = kNone;  ///< smallest time between two transitions [s]
  double cluster_spread = 0;      ///< largest spread of a cluster [s]
  /// With friction: the least ContactDynamics::slip_regularity at ends of steps and of arcs. Below
  /// zero forces beside the slip are not unique, or none exist (Painlevé).
  double painleve = kNone;
};

/// How much work a run took.
struct RunStatistics {
  long field_evaluations = 0;  ///< right-hand sides of (1a)
  long steps = 0;              ///< accepted
  long rejected_steps = 0;     ///< those that were repeated
  long implicit_steps = 0;     ///< of those accepted, by the implicit method
  long jacobians = 0;          ///< that the implicit method took
};

/// The hybrid execution of Def. 1: arcs separated by transitions, arcs.size() ==
/// transitions.size()+1. As a function of time it is left-continuous: at an event it takes the
/// value before the impact.
struct Trajectory {
  Status status;                        ///< how it ended
  std::vector<Arc> arcs;                ///< in the order of time
  std::vector<Transition> transitions;  ///< between them
  Margins margins;                      ///< how near it came to something worse
  RunStatistics statistics;             ///< counts of the work
  /// Where impacts (last) accumulate [s], predicted from the ratio of their intervals;
  /// NaN without Zeno.
  double accumulation_time = std::numeric_limits<double>::quiet_NaN();
  /// The first kMaxWarnings, in the order of time, and how many there were.
  std::vector<Warning> warnings;
  long num_warnings = 0;                     ///< all of them, also those that are not kept
  static constexpr long kMaxWarnings = 100;  ///< that are kept
  /// The one it was made with, or the largest that the errors of the instants asked for [s].
  double simultaneity_tolerance = 0;
  bool input_changes_at_end = false;  ///< at the end itself, as for all runs that are longer
  ImpactLaw impact_law = ImpactLaw::kComplementarity;       ///< the one it was made with
  IntegrationMethod method = IntegrationMethod::kExplicit;  ///< the one it was made with
  /// Those it was made with, as in SimulateOptions.
  double absolute_tolerance = 1e-9;
  double gap_tolerance = 1e-9;    ///< as absolute_tolerance
  double speed_tolerance = 1e-6;  ///< as absolute_tolerance

  /// Its beginning [s].
  double t_begin() const { return arcs.front().t_begin; }
  /// Its end [s].
  double t_end() const { return arcs.back().t_end; }
  /// x at its end [nq+d].
  const Vector& FinalState() const { return arcs.back().x_end; }
  /// J of each arc in turn; two equal neighbours are separated by a bounce.
  std::vector<ContactMode> ModeSequence() const;
  /// x(t) [2d] from the dense output; exact at the ends of arcs. Throws std::logic_error when the
  /// run was made without SimulateOptions::dense, std::out_of_range for t outside [t_begin, t_end].
  Vector State(double t) const;
  /// Index of the arc that holds t, the earlier one at an event.
  int ArcAt(double t) const;
};

}  // namespace contact_flow
