// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/transition.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "guarded.h"
#include "resolution.h"
#include "rest_error.h"
#include "src/dynamics/plastic_impact.h"

namespace contact_flow {

std::string Resolution::Sentence(const std::string& what) const {
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << result_.transition.t << " s " << what;
  return message.str();
}

/// The touching constraints that rest after an impact: those without normal velocity, unless
/// elastic and hit at some speed, which leave however slowly. A contact that rested before and is
/// pushed is no bounce.
ConstraintSet Resolution::Resting(const Vector& v_plus, ConstraintSet hit, ConstraintSet touching) {
  const Vector rate = terms_.jacobian * v_plus;
  const Vector v_minus = transition().x_minus.tail(d_);
  ConstraintSet resting, doubtful;
  doubtful_ = {};
  for (int i : touching) {
    const bool bounced = hit.Contains(i) && system_.restitution()(i) > 0 && rate_(i) < -Still(i);
    if (bounced) continue;
    const double low_speed =
        rules_.stalled ? kAboveDrift * std::max(Low(i), rules_.speed_tolerance) : Low(i);
    const bool low = transition().grazed.Contains(i) && std::abs(rate(i)) <= low_speed;
    // An impact leaves the rounding of what it has taken.
    const double rounding = std::max(Rounding(i, v_minus), Rounding(i, v_plus));
    if (low || std::abs(rate(i)) <= rounding) {
      resting.Insert(i);
    } else if (std::abs(rate(i)) <= rules_.speed_tolerance ||
               (rate(i) > 0 && !system_.HasContactEffort())) {
      doubtful.Insert(i);
    }
  }
  if (doubtful.Empty()) return resting;
  Vector x = transition().x_minus;
  x.tail(d_) = v_plus;
  const ContactMode mode = SelectContactMode(&dynamics_, x, resting, {}, pressed_);
  dynamics_.Evaluate(x, mode);
  const Vector acceleration = terms_.jacobian * dynamics_.acceleration() + terms_.bias;
  for (int i : doubtful) {
    const double lost =
        rate(i) > 0
            ? std::sqrt(2 * kNoReach * rules_.reach_tolerance * std::max(-acceleration(i), 0.0))
            : 0;
    if (std::abs(rate(i)) > std::max(lost, Still(i, v_plus, acceleration(i)))) continue;
    resting.Insert(i);
    doubtful_.Insert(i);
  }
  return resting;
}

/// Forces that vanish with the cluster: its own, and no others of members that are larger than what
/// tolerances may grow to, however little is known of its instant.
ForceTolerance Resolution::WhatVanishes() const {
  const Transition& cluster = result_.transition;
  if (rules_.simultaneity_tolerance > 0) return {cluster.tolerance};
  return {cluster.tolerance, cluster.mode_before - compliant_ - cluster.vanishing, &guard_reach_};
}

/// The mode behind an impact, of those that rest.
void Resolution::Settle(const Vector& v_plus, ConstraintSet hit, ConstraintSet resting,
                        const InverseInertia* inertia) {
  const ModeSelection selection =
      SelectMode(&dynamics_, transition().x_plus, resting, WhatVanishes(), pressed_, inertia);
  transition().mode_after = selection.mode;
  transition().implied = selection.implied;
  transition().touching = touching_ & (hit | selection.mode);
  Hold(v_plus, hit, selection.mode - compliant_);
}

/// Whether a contact that is hit, and bounced, approaches again, as others were made rest.
bool Resolution::TurnsBack(const Vector& v_plus, ConstraintSet hit) const {
  const Vector v = result_.transition.x_plus.tail(d_);
  for (int i : hit - result_.transition.mode_after) {
    if (!(system_.restitution()(i) > 0)) continue;
    const auto row = terms_.jacobian.row(i);
    if (row.dot(v_plus) > 0 && row.dot(v) < -Rounding(i, v)) return true;
  }
  return false;
}

/// What counted as rest is made rest: a contact that kept a speed within the tolerance would drift.
void Resolution::Hold(const Vector& v_plus, ConstraintSet hit, ConstraintSet held) {
  const Vector rate = terms_.jacobian * v_plus;
  double residual = 0, size = 0;
  int rising = -1;
  for (int i : held) {
    const double rounding = Rounding(i, transition().x_minus.tail(d_));
    residual = std::max(residual, std::abs(rate(i)));
    size = std::max(size, rounding);
    // Not what it drifted at before, within the integrator's tolerance.
    const bool rises =
        !hit.Contains(i) && rate(i) > kNotable * rules_.speed_tolerance &&
        rate(i) > kAboveDrift * std::abs(rate_(i) * !transition().grazed.Contains(i));
    if (rises && rate(i) > result_.rest_speed) {
      result_.rest_speed = rate(i);
      rising = i;
    }
    if (!hit.Contains(i) && rate(i) > kAboveDrift * std::max(rounding, std::abs(rate_(i)))) {
      result_.held_down.Insert(i);
    }
  }
  if (!(residual > size)) return;
  const ImpactResult rest = PlasticImpact(system_, transition().x_minus.head(nq_), v_plus, held);
  const auto interval = [&](int i) {
    dynamics_.Evaluate(transition().x_plus, transition().mode_after.Without(i));
    const double back = -(terms_.jacobian.row(i) * dynamics_.acceleration())(0) - terms_.bias(i);
    return back > 0 ? 2 * rate(i) / back : 0;
  };
  if (rising >= 0) result_.rest_interval = interval(rising);
  for (int i : result_.held_down) {
    result_.held_interval = std::max(result_.held_interval, interval(i));
  }
  transition().x_plus.tail(d_) = rest.v_plus;
  const Vector change = rest.v_plus - v_plus;
  const double bounces_last = std::max(result_.rest_interval, result_.held_interval);
  if (bounces_last > 0) {
    AddRestError(&dynamics_, result_.held_down, bounces_last, change, &transition());
  }
  const InverseInertia inertia(system_, transition().x_minus.head(nq_), v_plus);
  // M-orthogonal: |v⁺|² = |v|² − |change|².
  transition().energy_lost = 0.5 * change.dot(inertia.mass() * change);
  if (rising < 0) return;
  std::ostringstream message;
  message << "constraint '" << Name(rising) << "', which would rise at " << result_.rest_speed
          << " m/s and be pressed back after " << result_.rest_interval
          << " s, is taken to rest: " << transition().energy_lost << " J are lost";
  Warn(Outcome::kZeno, Sentence(message.str()));
}

void Resolution::WarnOfTouching(ConstraintSet hit) {
  const ConstraintSet took_part = (touching_ & hit) - rules_.implied;
  if (took_part.Empty()) return;
  const auto& names = system_.description().constraints;
  Warn(Outcome::kDiscontinuous,
       Sentence("contacts " + took_part.ToString(names) +
                " touch without force and are hit together with " +
                (hit - took_part).ToString(names) +
                ": all at once, by Newton's law (simultaneous Newton-Moreau); where they touch a "
                "little later the outcome may be another, it is not continuous here"));
}

/// Without impacts the state is continuous.
void Resolution::Release(ConstraintSet rigid) {
  const bool alone = transition().vanishing.Size() <= 1 && touching_.Empty() &&
                     transition().grazed.Empty() && !system_.HasContactEffort();
  if (alone) {
    transition().mode_after = ContactMode((rigid - transition().vanishing) | pressed_);
    return;
  }
  const ConstraintSet candidates =
      rigid | touching_ | (rules_.stalled ? ConstraintSet() : transition().grazed - compliant_);
  const ConstraintSet forced = rules_.stalled ? transition().vanishing : ConstraintSet();
  const ModeSelection selection =
      SelectMode(&dynamics_, transition().x_minus, candidates - forced, WhatVanishes(), pressed_);
  transition().mode_after = selection.mode;
  transition().implied = selection.implied;
  transition().touching = touching_ & selection.mode;
}

void Resolution::Decide() {
  Transition& cluster = transition();
  const ContactMode mode = cluster.mode_before;
  pressed_ = ((mode & compliant_) - cluster.switched) | (cluster.switched - mode);
  const ConstraintSet rigid = mode - compliant_;
  const ConstraintSet grazed = cluster.grazed - compliant_ - rigid;
  if (cluster.activated.Empty() && grazed.Empty()) return Release(rigid);
  const ConstraintSet touching = rigid | cluster.activated | grazed | touching_;
  const Vector v_minus = cluster.x_minus.tail(d_);
  bool approaches = !cluster.activated.Empty();
  for (int i : grazed) approaches = approaches || rate_(i) < -Rounding(i, v_minus);
  Vector v_plus = v_minus;
  ConstraintSet hit;
  std::optional<InverseInertia> inertia;
  if (approaches) {
    inertia.emplace(system_, cluster.x_minus.head(nq_), v_minus);
    ImpactResult impact = SolveImpact(system_, *inertia, v_minus, touching, rules_.impact_law);
    cluster.impulse = std::move(impact.impulse);
    v_plus = std::move(impact.v_plus);
    hit = impact.hit;
    WarnOfTouching(hit);
  }
  cluster.x_plus.tail(d_) = v_plus;
  const InverseInertia* known = inertia ? &*inertia : nullptr;
  const ConstraintSet resting = Resting(v_plus, hit, touching);
  if (doubtful_.Empty()) return Settle(v_plus, hit, resting, known);
  const ResolvedTransition decided = result_;
  Settle(v_plus, hit, resting, known);
  if (!TurnsBack(v_plus, hit)) return;
  result_ = decided;  // what rises so slowly rises all the same
  Settle(v_plus, hit, resting - doubtful_, known);
}

ResolvedTransition ResolveTransition(ContactDynamics* dynamics, double t, const Vector& x,
                                     ContactMode mode, int trigger, const TransitionRules& rules) {
  const MechanicalSystem& system = dynamics->system();
  Resolution resolution(dynamics, t, x, mode, rules);
  const Status status = Guarded(t, [&] {
    resolution.Collect(trigger);
    resolution.Decide();
  });
  ResolvedTransition result = resolution.Take();
  result.status = status;
  NoteImplied(system, &result.transition);
  result.transition.released = mode - result.transition.mode_after;
  return result;
}

}  // namespace contact_flow
