// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include "contact_flow/flow/transition.h"
#include "guarded.h"
#include "src/dynamics/mode_selection.h"

namespace contact_flow {
namespace {

constexpr double kRateRounding = 1e-12;  // of a rate, relative to what it is the sum of

}  // namespace

void NoteImplied(const MechanicalSystem& system, Transition* transition) {
  if (transition->implied.Empty() || !transition->obstacle.ok()) return;
  const auto& names = system.description().constraints;
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << transition->t << " s contacts " << transition->implied.ToString(names)
          << " are held by " << transition->mode_after.ToString(names)
          << ", on whose rows of Da theirs depend (Assumption 3): no derivative";
  transition->obstacle = {Outcome::kNotDifferentiable, message.str()};
}

ResolvedTransition ResolveInputChange(ContactDynamics* dynamics, double t, const Vector& x,
                                      ContactMode mode, const TransitionRules& rules) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions();
  ResolvedTransition result;
  result.approach_speed = result.release_rate = std::numeric_limits<double>::infinity();
  Transition& transition = result.transition;
  transition.t = t;
  transition.x_minus = transition.x_plus = x;
  transition.mode_before = transition.mode_after = mode;
  transition.impulse = Vector::Zero(system.num_rows());
  transition.changes_input = true;
  const ConstraintSet pressed = mode & system.compliant();
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  const Vector rate = terms.jacobian * x.tail(d);
  ConstraintSet touching;
  for (int i = 0; i < system.num_constraints(); ++i) {
    if (mode.Contains(i) || system.compliant().Contains(i)) continue;
    const double still = kRateRounding * terms.jacobian.row(i).cwiseAbs().dot(x.tail(d).cwiseAbs());
    if (std::abs(terms.gap(i)) <= rules.gap_tolerance && std::abs(rate(i)) <= still) {
      touching.Insert(i);
    }
  }
  result.status = Guarded(t, [&] {
    const ModeSelection selection =
        SelectMode(dynamics, x, (mode - pressed) | touching, {}, pressed);
    transition.mode_after = selection.mode;
    transition.implied = selection.implied;
    transition.touching = touching & selection.mode;
  });
  NoteImplied(system, &transition);
  transition.released = mode - transition.mode_after;
  return result;
}

}  // namespace contact_flow
