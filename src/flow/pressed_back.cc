// SPDX-License-Identifier: BSD-3-Clause
// Contacts that an impact throws up so little that they are pressed back before it can be seen.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "contact_flow/model/driven.h"
#include "frictional_resolution.h"
#include "src/dynamics/implied_contacts.h"
#include "src/dynamics/rest_impulse.h"

namespace contact_flow {
namespace {

/// How closely the inequalities of a word have to hold, at least.
constexpr double kRestingBorder = 1e-10;
/// Slips in the plane, and rises of others, that are so many times what such bounces change go on
/// in spite of them; slips in space keep their directions.
constexpr double kGoesOn = 3, kKeepsDirection = 1e3;

}  // namespace

/// Those of `leaving` that the motion of the others presses back before they have risen to what
/// the integration resolves: a touchdown that follows is where they are, and each throws another
/// one up. They rest, and may press back further ones. The state is that after the impact.
ConstraintSet FrictionalResolution::PressedBack(const Vector& rate, ConstraintSet leaving,
                                                ConstraintSet still, TouchingContacts resting) {
  ConstraintSet back;
  if (leaving.Empty()) return back;
  const Vector& x = result_.transition.x_plus;
  const Vector v = x.tail(d_);
  risen_ = rate;
  bounces_change_ = Vector::Zero(system_.num_rows());
  while (true) {
    try {
      WordConventions by;
      dynamics_.Evaluate(x, SelectWord(&dynamics_, x, resting, kRestingBorder, &by));
    } catch (const FrictionRefusal&) {
      return back;
    }
    const Vector acceleration = terms_.jacobian * dynamics_.acceleration() + terms_.bias;
    const ConstraintSet before = back;
    double longest = 0;
    for (int i : leaving - before) {
      if (!(rate(i) * rate(i) <= -2 * acceleration(i) * rules_.reach_tolerance)) continue;
      back.Insert(i);
      fastest_rise_ = std::max(fastest_rise_, rate(i));
      longest = std::max(longest, -2 * rate(i) / acceleration(i));
      SortRising(i, rate, v, rate(i), &still, &resting);
    }
    if (back == before) return back;
    bounces_change_ += longest * acceleration.cwiseAbs();
  }
}

void FrictionalResolution::TellOfRest(ConstraintSet pressed_back) {
  if (pressed_back.Empty()) return;
  const bool known = Notable() ? result_.transition.rest_impulse.size() > 0 : BouncesTurnNothing();
  if (known) result_.transition.rested = resting_;
  if (!Notable()) return;
  std::ostringstream message;
  message.precision(12);
  message
      << "at t = " << result_.transition.t << " s contacts "
      << pressed_back.ToString(system_.description().constraints) << ", which would rise at up to "
      << fastest_rise_
      << " m/s and be pressed back at once, are taken to rest, which changes the kinetic energy "
         "by "
      << -result_.transition.energy_lost << " J";
  if (!known && result_.transition.obstacle.ok()) {
    result_.transition.obstacle = {Outcome::kZeno, message.str()};
  }
  result_.warnings.push_back({Outcome::kZeno, result_.transition.t, message.str()});
}

/// Whether all contacts behind one touchdown have the letters after it as often as they push, or
/// end with them, however those that are pressed back bounce: then what they come to depends on
/// nothing else (BringToRest).
bool FrictionalResolution::BouncesTurnNothing() const {
  const Transition& cluster = result_.transition;
  const bool alone = cluster.activated.Size() == 1 && cluster.guards.size() == 1 &&
                     grazed_.Empty() && stopped_.Empty() && implied_.Empty() && halted_.Empty();
  if (!alone || !cluster.obstacle.ok() || resting_ != cluster.mode_after) return false;
  const Vector now = terms_.jacobian * cluster.x_plus.tail(d_);
  const Vector change = bounces_change_ + (now - risen_).cwiseAbs();
  for (int i = 0; i < system_.num_constraints(); ++i) {
    if (system_.compliant().Contains(i)) continue;
    if (!cluster.mode_after.Contains(i)) {
      const bool near = std::abs(terms_.gap(i)) <= rules_.gap_tolerance;
      if (near && !(now(i) > kGoesOn * change(i))) return false;
      continue;
    }
    const Friction& friction = system_.friction()[i];
    const bool rubs = friction.dimension > 0 && friction.coefficient > 0;
    if (!rubs || cluster.mode_after.LetterOf(i) == Letter::kStick) continue;
    const double slip = now.segment(friction.row, friction.dimension).norm();
    const double changed = change.segment(friction.row, friction.dimension).norm();
    if (!(slip > (friction.dimension == 2 ? kKeepsDirection : kGoesOn) * changed)) return false;
  }
  return true;
}

void FrictionalResolution::Rest(const std::map<int, Eigen::Vector2d>& onsets) {
  Vector& x = result_.transition.x_plus;
  if (!Notable()) return MakeRest(system_, resting_, onsets, &x);
  const InverseInertia inertia(system_, x.head(nq_), x.tail(d_));
  const Vector v = x.tail(d_);
  const RestImpulse rest = BringToRest(system_, inertia, v, resting_);
  x.tail(d_) = rest.v_plus;
  Vector& impulse = result_.transition.rest_impulse;  // letters may be chosen anew
  if (rest.v_plus.allFinite() && BouncesTurnNothing()) {
    impulse = impulse.size() > 0 ? Vector(impulse + rest.impulse) : rest.impulse;
  } else {
    x.tail(d_) = v;
    impulse = Vector();
  }
  MakeRest(system_, resting_, onsets, &x);
  result_.transition.energy_lost +=
      KineticEnergy(inertia.mass(), v) - KineticEnergy(inertia.mass(), x.tail(d_));
}

}  // namespace contact_flow
