// SPDX-License-Identifier: BSD-3-Clause
// Transitions of systems with friction.
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "contact_flow/model/driven.h"
#include "force_slack.h"
#include "frictional_resolution.h"
#include "guard_zeros.h"
#include "guarded.h"
#include "src/dynamics/implied_contacts.h"
#include "stop_in_space.h"

namespace contact_flow {
namespace {

/// A pull that is none of rounding, relative to the largest acceleration of a gap.
constexpr double kPulled = 1e-7;
/// Slips of one face end at one instant, but for this.
constexpr double kAlike = 1.01;

/// What the rate of a row is known to beside a motion of this speed, in the kinetic metric.
double KineticRounding(const InverseInertia& inertia, const Vector& row, double speed) {
  return kRounding * std::sqrt(row.dot(Vector(inertia * row))) * speed;
}

}  // namespace

void FrictionalResolution::Collect(int trigger) {
  Transition& cluster = result_.transition;
  const ContactMode mode = cluster.mode_before;
  const GuardZeros zeros(&dynamics_, cluster.t, cluster.x_minus, mode, trigger, rules_);
  acceleration_ = zeros.acceleration();
  const GuardZero located = zeros.At(trigger);
  const double own = located.error;
  if (zeros.SlipInSpaceEnds()) {
    const int i = guards_.ConstraintOf(trigger);
    stopped_ = StoppedTogether(system_, terms_, dynamics_.acceleration(), i, &cluster);
    cluster.guards.push_back(trigger);
    cluster.instants.push_back({i, 0, own});
  }
  const double asked = rules_.simultaneity_tolerance;
  cluster.tolerance = asked > 0 ? asked : kInstantErrors * own;
  double first = std::numeric_limits<double>::infinity(), last = -first;
  std::vector<std::pair<double, int>> order;
  for (int g : zeros.forces() | guards_.OfSlips(mode) | guards_.OfGaps(mode)) {
    const GuardZero zero = zeros.At(g);
    const double within =
        asked > 0 ? -zero.slope * asked
                  : std::min(zero.reach, -zero.slope * kInstantErrors * (own + zero.error));
    const bool here = zero.slope < 0 && std::abs(zero.value) <= within;
    if (g != trigger && !here && !StopsBefore(g, zero, trigger, located)) continue;
    const double offset = zero.slope != 0 ? -zero.value / zero.slope : 0;
    order.emplace_back(offset, g);
    first = std::min(first, offset);
    last = std::max(last, offset);
    cluster.instants.push_back({guards_.ConstraintOf(g), offset, zero.error});
    Note(g, zero.slope);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [offset, guard] : order) cluster.guards.push_back(guard);
  cluster.spread = std::max(0.0, last - first);
}

/// Where a slip ends a little before its speed is zero, as the input changes next: whether that of
/// `guard` is no later, and no faster than what is told from none. A face stops as a whole.
bool FrictionalResolution::StopsBefore(int guard, const GuardZero& zero, int trigger,
                                       const GuardZero& located) const {
  const ContactMode mode = result_.transition.mode_before;
  const ConstraintSet slips = guards_.OfSlips(mode);
  if (!slips.Contains(guard) || !slips.Contains(trigger)) return false;
  if (!(zero.slope < 0) || !(located.slope < 0) || !(located.value > 0)) return false;
  const int row = system_.friction()[guards_.ConstraintOf(guard)].row;
  const double speed = result_.transition.x_minus.tail(d_).norm();
  const double rest = UnresolvedSlip(rules_, terms_.jacobian.row(row).norm(), speed);
  return zero.value <= rest && zero.value * -located.slope <= kAlike * located.value * -zero.slope;
}

void FrictionalResolution::Decide() {
  Transition& cluster = result_.transition;
  const Vector v_minus = cluster.x_minus.tail(d_);
  const ConstraintSet before = cluster.mode_before;
  ConstraintSet touching = before | cluster.activated | grazed_;
  for (int i = 0; i < system_.num_constraints(); ++i) {
    if (touching.Contains(i) || std::abs(terms_.gap(i)) > rules_.gap_tolerance) continue;
    if (std::abs(rate_(i)) <= RestRounding(i, v_minus)) touching.Insert(i);
  }
  implied_ = AddImplied(touching);
  touching = touching | implied_;
  const ConstraintSet beside = touching - before - cluster.activated;
  Vector v_plus = v_minus;
  ConstraintSet held;  // by the impact
  ConstraintSet still = cluster.mode_before.Sticking() | stopped_;
  if (!cluster.activated.Empty()) {
    WordConventions by;
    const FrictionalImpact impact = SolveFrictionalImpact(
        system_, cluster.x_minus.head(nq_), v_minus, touching, cluster.mode_before, &by);
    if (by.smallest) NoteSmallest(touching);
    v_plus = impact.result.v_plus;
    cluster.impulse = impact.result.impulse;
    cluster.impulse_word = impact.word;
    cluster.energy_change = impact.energy_change;
    if (impact.springs) NoteSprings(touching, "impulses");
    still = impact.word.Sticking();
    for (int i : impact.word) {
      const bool bounces = cluster.activated.Contains(i) && system_.restitution()(i) > 0;
      if (!bounces) held.Insert(i);
    }
    FindJumpRounding(touching, v_plus - v_minus);
    const ConstraintSet elsewhere = (cluster.mode_before.Sticking() | stopped_) - impact.word;
    still = still | LeftStill(elsewhere, v_plus - v_minus);
  }
  const Vector rate = terms_.jacobian * v_plus;
  const auto bounced = [&](int i) {
    return cluster.activated.Contains(i) && system_.restitution()(i) > 0;
  };
  const auto low = [&](int i) { return grazed_.Contains(i) ? Low(i) : 0; };
  ConstraintSet rising;
  for (int i : touching - held) {
    const double rest = std::max({RestRounding(i, v_plus), bounced(i) ? 0 : Drift(i), low(i)});
    if (rate(i) > rest) rising.Insert(i);
  }
  still = still | ImpliedStill(system_, cluster.x_minus, touching - rising, still & touching);
  TouchingContacts contacts;
  contacts.slack = ForceSlack(&dynamics_, cluster);
  if (cluster.activated.Empty()) contacts.before = cluster.mode_before;
  contacts.ended = rules_.stalled && cluster.activated.Empty() && !grazed_.Empty();
  ConstraintSet leaving, leaving_hit;
  for (int i : rising) {
    if (!cluster.activated.Empty()) (bounced(i) ? leaving_hit : leaving).Insert(i);
  }
  for (int i : touching - rising) SortRising(i, rate, v_plus, low(i), &still, &contacts);
  cluster.x_plus.tail(d_) = v_plus;
  RestOrFollow({rate, leaving, leaving_hit, still, contacts});
  cluster.touching = beside & (cluster.impulse_word | cluster.mode_after);
  TellOfApex((beside & cluster.mode_after) - implied_ - grazed_);
}

/// What the normal rate of a contact is known to that may rest while others move.
double FrictionalResolution::RestRounding(int i, const Vector& v) const {
  const double own = RateRounding(i, v);
  const Vector row = terms_.jacobian.row(i);
  if (std::abs(row.dot(v)) <= own) return own;
  const InverseInertia inertia(system_, result_.transition.x_minus.head(nq_), v);
  return std::max(own, KineticRounding(inertia, row, KineticSpeed(inertia.mass(), v)));
}

void FrictionalResolution::FindJumpRounding(ConstraintSet touching, const Vector& jump) {
  const Vector& x = result_.transition.x_minus;
  const InverseInertia inertia(system_, x.head(nq_), x.tail(d_));
  const double speed = KineticSpeed(inertia.mass(), jump);
  jump_rounding_ = Vector::Zero(system_.num_rows());
  const auto find = [&](int k) {
    jump_rounding_(k) = KineticRounding(inertia, terms_.jacobian.row(k), speed);
  };
  for (int i : touching) {
    const Friction& friction = system_.friction()[i];
    find(i);
    for (int k = friction.row; k < friction.row + friction.dimension; ++k) find(k);
  }
}

/// Those of `contacts` that a jump of the velocity does not make slip: by more than rounding.
ConstraintSet FrictionalResolution::LeftStill(ConstraintSet contacts, const Vector& jump) const {
  ConstraintSet left;
  const Vector v_plus = result_.transition.x_minus.tail(d_) + jump;
  for (int i : contacts) {
    const Friction& friction = system_.friction()[i];
    bool slips = false;
    for (int k = friction.row; k < friction.row + friction.dimension; ++k) {
      slips = slips || std::abs(terms_.jacobian.row(k).dot(jump)) > RateRounding(k, v_plus);
    }
    if (!slips) left.Insert(i);
  }
  return left;
}

/// Contacts that are `closed` by no impact although they were pulled back: within the tolerance of
/// the surface their rise has ended just here, as a slip that holds them ends. Bounces lower than
/// that follow, and accumulate.
void FrictionalResolution::TellOfApex(ConstraintSet closed) {
  if (acceleration_.size() == 0) return;
  const double least = -kPulled * acceleration_.cwiseAbs().maxCoeff();
  for (int i : closed) {
    if (!(acceleration_(i) < least)) closed.Erase(i);
  }
  if (closed.Empty()) return;
  double height = 0;
  for (int i : closed) height = std::max(height, terms_.gap(i));
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << result_.transition.t << " s contacts "
          << closed.ToString(system_.description().constraints) << " have stopped, up to " << height
          << " m from touching, where they would be pulled back to ever lower bounces: they are "
             "taken to rest";
  if (result_.transition.obstacle.ok()) {
    result_.transition.obstacle = {Outcome::kZeno, message.str()};
  }
  result_.warnings.push_back({Outcome::kZeno, result_.transition.t, message.str()});
}

/// Contacts that the others of one body bring along, a gap that is a sum of theirs: they land
/// with them, or touch.
ConstraintSet FrictionalResolution::AddImplied(ConstraintSet touching) {
  ConstraintSet near;
  for (int i : ConstraintSet::All(system_.num_constraints()) - touching) {
    if (std::abs(terms_.gap(i)) <= rules_.gap_tolerance) near.Insert(i);
  }
  Transition& cluster = result_.transition;
  const ConstraintSet implied = ImpliedClosed(system_, cluster.x_minus, touching, near);
  for (int i : implied) {
    if (rate_(i) < -Rounding(i, cluster.x_minus.tail(d_))) cluster.activated.Insert(i);
  }
  return implied;
}

/// What follows where a guard vanishes, by its kind.
void FrictionalResolution::Note(int guard, double slope) {
  Transition& cluster = result_.transition;
  const int i = guards_.ConstraintOf(guard);
  switch (guards_.KindOf(guard, cluster.mode_before, dynamics_.shared())) {
    case GuardKind::kGap:
      NoteTouch(i, slope);
      break;
    case GuardKind::kForce:
      cluster.vanishing.Insert(i);
      result_.release_rate = std::min(result_.release_rate, -slope);
      if (!(slope < 0)) Obstruct(i, "lets go with a force rate of", slope, "N/s");
      break;
    case GuardKind::kCone:
      if (!(slope < 0)) Obstruct(i, "reaches its friction cone at a rate of", slope, "N/s");
      break;
    case GuardKind::kSlip:
      stopped_.Insert(i);
      if (!(slope < 0)) Obstruct(i, "stops slipping with an acceleration of", slope, "m/s^2");
      break;
  }
}

void FrictionalResolution::NoteTouch(int i, double slope) {
  Transition& cluster = result_.transition;
  // The same event at the same time: it opens too slowly to be taken for a touch without speed.
  const double slow = rules_.stalled || all_hit_ ? 0 : Unresolved();
  const double still = std::max(Rounding(i, cluster.x_minus.tail(d_)), slow);
  if (slope < -still) {
    cluster.activated.Insert(i);
    result_.approach_speed = std::min(result_.approach_speed, -slope);
    return;
  }
  grazed_.Insert(i);
  Obstruct(i, "is touched with normal velocity", slope, "m/s");
}

void FrictionalResolution::Obstruct(int i, const char* what, double slope, const char* unit) {
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << result_.transition.t << " s contact '"
          << system_.description().constraints[i] << "' " << what << ' ' << slope << ' ' << unit
          << ": grazing";
  result_.transition.grazed.Insert(i);
  result_.transition.obstacle = {Outcome::kGrazing, message.str()};
  result_.warnings.push_back({Outcome::kGrazing, result_.transition.t, message.str()});
}

ResolvedTransition ResolveFriction(ContactDynamics* dynamics, double t, const Vector& x,
                                   ContactMode mode, int trigger, const TransitionRules& rules) {
  const auto resolve = [&](bool all_hit) {
    FrictionalResolution resolution(dynamics, t, x, mode, rules);
    if (all_hit) resolution.LetAllHit();
    const Status status = Guarded(t, [&] {
      resolution.Collect(trigger);
      resolution.Decide();
    });
    ResolvedTransition result = resolution.Take();
    result.status = status;
    result.transition.released = mode - result.transition.mode_after;
    return result;
  };
  ResolvedTransition result = resolve(false);
  // A slip that is as slow as the touch has a direction for which no forces may exist, and ends by
  // its impact.
  const bool none = result.status.outcome == Outcome::kPainleveInconsistent ||
                    result.status.outcome == Outcome::kIndeterminateForces;
  if (!none || (result.transition.grazed - mode).Empty()) return result;
  ResolvedTransition hit = resolve(true);
  if (!hit.status.ok()) return result;
  hit.warnings.insert(hit.warnings.begin(), result.warnings.begin(), result.warnings.end());
  hit.transition.obstacle = result.transition.obstacle;  // its speed is not known well enough
  return hit;
}

}  // namespace contact_flow
