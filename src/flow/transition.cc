// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/transition.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "contact_flow/dynamics/mode_selection.h"
#include "contact_flow/dynamics/sticking.h"

namespace contact_flow {
namespace {

constexpr double kRounding = 1e-12;

/// First and last of a set of times.
class Spread {
 public:
  void Add(double t) {
    first_ = std::min(first_, t);
    last_ = std::max(last_, t);
  }
  double Length() const { return last_ > first_ ? last_ - first_ : 0; }

 private:
  double first_ = std::numeric_limits<double>::infinity();
  double last_ = -std::numeric_limits<double>::infinity();
};

/// The touching constraints that rest after an impact: those without normal velocity, unless
/// elastic and hit, which leave however slowly.
ContactMode Resting(const MechanicalSystem& system, const Vector& normal_velocity,
                    const ImpactResult& impact, ContactMode touching, double speed_tolerance) {
  ContactMode resting;
  for (int i : touching) {
    const bool bounced = impact.hit.Contains(i) && system.restitution()(i) > 0;
    const bool still = std::abs(normal_velocity(i)) <= speed_tolerance;
    if (still && !bounced) resting.Insert(i);
  }
  return resting;
}

/// Velocity and contact mode after the cluster.
void DecideMode(ContactDynamics* dynamics, const Vector& x, const TransitionRules& rules,
                const Matrix& jacobian, const Vector& rate, Transition* transition) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions();
  const ContactMode compliant = system.compliant(), mode = transition->mode_before;
  const ContactMode pressed =
      ((mode & compliant) - transition->switched) | (transition->switched - mode);
  const ContactMode rigid = mode - compliant;
  if (transition->activated.Empty()) {
    transition->mode_after =
        system.HasContactEffort()
            ? SelectContactMode(dynamics, x, rigid, rules.simultaneity_tolerance, pressed)
            : (rigid - transition->vanishing) | pressed;
    return;
  }
  const ContactMode touching = rigid | transition->activated;
  const ImpactResult impact =
      SolveImpact(system, x.head(nq), x.tail(d), touching, rules.impact_law);
  transition->impulse = impact.impulse;
  transition->x_plus.tail(d) = impact.v_plus;
  const Vector normal_velocity = jacobian * impact.v_plus;
  const ContactMode resting =
      Resting(system, normal_velocity, impact, touching, rules.speed_tolerance);
  transition->mode_after = SelectContactMode(dynamics, transition->x_plus, resting,
                                             rules.simultaneity_tolerance, pressed);
  // What counted as rest is made rest: a contact that kept a speed within the tolerance would
  // drift.
  const ContactMode held = transition->mode_after - compliant;
  double residual = 0;
  for (int i : held) residual = std::max(residual, std::abs(normal_velocity(i)));
  if (residual > kRounding * rate.cwiseAbs().maxCoeff()) {
    transition->x_plus.tail(d) = Stick(system, x.head(nq), impact.v_plus, held).v_plus;
  }
}

}  // namespace

ResolvedTransition ResolveTransition(ContactDynamics* dynamics, double t, const Vector& x,
                                     ContactMode mode, int trigger, const TransitionRules& rules) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions(), n = system.num_constraints();
  const ContactMode compliant = system.compliant();
  ResolvedTransition result;
  result.approach_speed = result.release_rate = std::numeric_limits<double>::infinity();
  Transition& transition = result.transition;
  transition.t = t;
  transition.x_minus = transition.x_plus = x;
  transition.mode_before = transition.mode_after = mode;
  transition.impulse = Vector::Zero(n + system.num_bilateral());
  transition.impact_law = rules.impact_law;
  transition.relative_tolerance = rules.relative_tolerance;
  transition.absolute_tolerance = rules.absolute_tolerance;

  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  const Vector rate = terms.jacobian * x.tail(d);
  const Vector force_rate = dynamics->ForceRate(x, mode);
  const Vector force = dynamics->force();

  Spread spread;
  for (int i = 0; i < n; ++i) {
    const bool member = (mode - compliant).Contains(i);
    const double sign = (mode & compliant).Contains(i) ? -1 : 1;
    const double value = member ? force(i) : sign * terms.gap(i);
    const double slope = member ? force_rate(i) : sign * rate(i);
    const double slow = member ? 0 : rules.speed_tolerance;
    if (i == trigger && slope >= -slow) {
      std::ostringstream message;
      message << "constraint '" << system.description().constraints[i] << "' "
              << (member ? "lets go" : "is touched") << " at t = " << t << " s with "
              << (member ? "dλ/dt = " : "normal velocity ") << slope << (member ? " N/s" : " m/s")
              << ": grazing, not admissible";
      result.status = {Outcome::kGrazing, message.str()};
      return result;
    }
    if (slope >= -slow || (i != trigger && value > rules.simultaneity_tolerance * -slope)) continue;
    spread.Add(-value / slope);
    (compliant.Contains(i) ? transition.switched
     : member              ? transition.vanishing
                           : transition.activated)
        .Insert(i);
    double& margin = member ? result.release_rate : result.approach_speed;
    margin = std::min(margin, -slope);
  }
  transition.spread = spread.Length();

  try {
    DecideMode(dynamics, x, rules, terms.jacobian, rate, &transition);
  } catch (const UndecidedMode& reason) {
    std::ostringstream message;
    message << "at t = " << t << " s: " << reason.what();
    result.status = {Outcome::kFilippov, message.str()};
    return result;
  } catch (const std::domain_error& reason) {
    std::ostringstream message;
    message << "at t = " << t << " s " << reason.what();
    result.status = {Outcome::kNonFinite, message.str()};
    return result;
  }
  transition.released = mode - transition.mode_after;
  return result;
}

ResolvedTransition ResolveInputChange(ContactDynamics* dynamics, double t, const Vector& x,
                                      ContactMode mode) {
  const MechanicalSystem& system = dynamics->system();
  ResolvedTransition result;
  result.approach_speed = result.release_rate = std::numeric_limits<double>::infinity();
  Transition& transition = result.transition;
  transition.t = t;
  transition.x_minus = transition.x_plus = x;
  transition.mode_before = mode;
  transition.impulse = Vector::Zero(system.num_constraints() + system.num_bilateral());
  transition.changes_input = true;
  const ContactMode pressed = mode & system.compliant();
  try {
    transition.mode_after = SelectContactMode(dynamics, x, mode - pressed, 0, pressed);
  } catch (const UndecidedMode& reason) {
    std::ostringstream message;
    message << "at t = " << t << " s: " << reason.what();
    result.status = {Outcome::kFilippov, message.str()};
    return result;
  }
  transition.released = mode - transition.mode_after;
  return result;
}

}  // namespace contact_flow
