// SPDX-License-Identifier: BSD-3-Clause
#include "arc_checks.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "contact_flow/dynamics/guards.h"
#include "free_slips.h"
#include "idle_contacts.h"
#include "resting_corners.h"
#include "src/dynamics/implied_contacts.h"
#include "src/dynamics/slips_in_space.h"

namespace contact_flow {
namespace {

/// A force that is known all along an arc to less than this part of the absolute tolerance
/// may be anything.
constexpr double kIdle = 1e-3;

/// Contacts of a face beside those that carry it while it slides in space: they could as well.
ConstraintSet IdleCorners(const MechanicalSystem& system, const Arc& arc, double gap_tolerance) {
  const auto turns = [&](int i) {
    return system.friction()[i].dimension == 2 && system.friction()[i].coefficient > 0;
  };
  bool slides = false;
  for (int i : arc.mode) slides = slides || (turns(i) && arc.mode.LetterOf(i) == Letter::kSlip);
  if (!slides) return {};
  ConstraintTerms terms;
  system.Constraints(arc.x_begin.head(system.num_positions()), arc.x_begin.tail(system.dof()),
                     &terms);
  ConstraintSet near;
  for (int i = 0; i < system.num_constraints(); ++i) {
    const bool beside = !arc.mode.Contains(i) && !system.compliant().Contains(i) && turns(i);
    if (beside && std::abs(terms.gap(i)) <= gap_tolerance) near.Insert(i);
  }
  return near.Empty() ? near : ImpliedClosed(system, arc.x_begin, arc.mode, near);
}

}  // namespace

bool ForcesDecide(const MechanicalSystem& system, const Transition& transition) {
  if (!transition.vanishing.Empty()) return true;
  const Guards guards(system);
  return std::any_of(transition.guards.begin(), transition.guards.end(), [&](int guard) {
    return IsOfForces(guards.KindOf(guard, transition.mode_before));
  });
}

Status CheckArc(ContactDynamics* dynamics, const Arc& arc, const ArcInRun& in_run) {
  Status status = CheckFreeSlips(*dynamics, arc);
  if (status.ok()) {
    const RestingQuestion question{in_run.instant, in_run.forces_decide, in_run.inputs};
    status = CheckRestingCorners(*dynamics, arc, question);
  }
  if (!status.ok()) return status;
  return CheckIdleContacts(dynamics, arc, in_run);
}

Status CheckPushes(const MechanicalSystem& system, const Arc& arc, const Vector& push_reach,
                   double absolute_tolerance) {
  if (arc.t_end == arc.t_begin) return {};
  for (int i : arc.mode - system.compliant()) {
    if (push_reach(i) > kIdle * absolute_tolerance) continue;
    std::ostringstream message;
    message.precision(12);
    message << "from t = " << arc.t_begin << " s to " << arc.t_end << " s the contact '"
            << system.description().constraints[i]
            << "' holds without a force: whether it does in a perturbed run is decided by nothing "
               "that is known here";
    return {Outcome::kNotDifferentiable, message.str()};
  }
  return {};
}

Status CheckSlidingFace(ContactDynamics* dynamics, const Arc& arc, double gap_tolerance) {
  const MechanicalSystem& system = dynamics->system();
  if (!system.HasFriction()) return {};
  dynamics->Evaluate(arc.x_begin, arc.mode);
  const std::string from = "from t = " + std::to_string(arc.t_begin) + " s on the contacts ";
  const ConstraintSet idle = IdleCorners(system, arc, gap_tolerance);
  if (!dynamics->springs().Empty() || !idle.Empty()) {
    const ConstraintSet face = idle.Empty() ? dynamics->springs() : arc.mode | idle;
    return {Outcome::kIndeterminateForces,
            from + face.ToString(system.description().constraints) +
                " share forces that decide the motion: another share is as possible"};
  }
  if (!(SlipsInSpace(system, arc.mode) & dynamics->shared()).Empty()) {
    return {Outcome::kNotDifferentiable,
            from + dynamics->shared().ToString(system.description().constraints) +
                " slide without turning and share their forces: a run that turns is not unique"};
  }
  return {};
}

}  // namespace contact_flow
