// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>

#include "contact_flow/dynamics/impact.h"
#include "contact_flow/flow/input_schedule.h"
#include "contact_flow/flow/integration_method.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// Settings of one run. Every default works for every shipped model.
struct SimulateOptions {
  double relative_tolerance = 1e-9;  ///< of the integrator, per step, on (q, v)
  double absolute_tolerance = 1e-9;  ///< [m], [m/s], [rad], [rad/s]
  double max_step = 0;               ///< [s]; 0: no limit
  /// Events closer than this in time are one simultaneous cluster [s]. 0: those whose instants the
  /// integrator's errors do not tell apart (kInstantErrors).
  double simultaneity_tolerance = 0;
  /// |a_i| below this counts as touching in an initial state [m].
  double gap_tolerance = 1e-9;
  /// |Da_i v| below this counts as zero: resting, or grazing at an activation [m/s]. Where
  /// accelerations are so weak that such a speed v reaches further than absolute_tolerance,
  /// v²/(2|ä_i|), correspondingly less does.
  double speed_tolerance = 1e-6;
  /// Impacts whose intervals shrink geometrically, of one constraint, of several in turns or in a
  /// pattern, are Zeno once the intervals are below this part of the first of their sequence.
  /// Bounces of elastic contacts that no longer reach absolute_tolerance are Zeno in any case.
  double zeno_interval = 1e-5;
  /// Go on from there with the contact sticking, instead of stopping with Outcome::kZeno. The rest
  /// of the bounces is taken as one plastic impact. No derivative then. Plastic contacts that hit
  /// in turns (a foot that rocks from heel to toe) are completed without being asked, with a
  /// warning: with friction always, without where that takes less kinetic energy than is left, as
  /// they are not all of the motion.
  bool complete_zeno = false;
  long max_steps = 100000;      ///< budget
  long max_events = 10000;      ///< budget
  double max_seconds = 60;      ///< processor time of the thread [s]; see also Budget
  double max_megabytes = 1000;  ///< of the trajectory, and of any one thing made of it [10⁶ byte]
  ImpactLaw impact_law = ImpactLaw::kComplementarity;        ///< which impulses
  IntegrationMethod method = IntegrationMethod::kAutomatic;  ///< of the motion between events
  bool dense = true;  ///< keep the motion between events, so that Trajectory::State(t) works
  /// Asked now and then; returning true stops the run with Outcome::kCancelled.
  std::function<bool()> cancelled;
};

/// Throws std::invalid_argument, naming option and value, unless every number is in its range.
void Validate(const SimulateOptions& options);

/// The contact mode of a state (theory of Sec. 2): C = {i : a_i = 0, Da_i v = 0} within tolerance,
/// then acceleration-level complementarity over C, and the compliant constraints that are pressed.
/// Throws std::invalid_argument, naming the constraint and the value, for a state that penetrates
/// (a_i < 0), moves into a contact (a_i = 0, Da_i v < 0), leaves b(q) = 0 or has a quaternion that
/// is not a unit one.
ContactMode InitialMode(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u,
                        const SimulateOptions& options = {});

/// Flows the system from x at time 0 for `duration` seconds ≥ 0 with constant input u (Def. 1).
/// Throws std::invalid_argument for sizes, non-finite numbers, and states InitialMode refuses.
Trajectory Simulate(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u,
                    double duration, const SimulateOptions& options = {});
/// The same from grid[0] on with an input that is piecewise constant on a grid. The motion up to an
/// instant of the grid does not depend, to the bit, on that instant and the inputs from it on.
Trajectory Simulate(const MechanicalSystem& system, const VectorRef& x,
                    const InputSchedule& schedule, double duration,
                    const SimulateOptions& options = {});

}  // namespace contact_flow
