// SPDX-License-Identifier: BSD-3-Clause
// Contacts that an impact throws up so little that they are pressed back before it can be seen.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "contact_flow/model/driven.h"
#include "frictional_resolution.h"
#include "rest_error.h"
#include "src/dynamics/implied_contacts.h"
#include "src/dynamics/rest_impulse.h"

namespace contact_flow {
namespace {

/// By how much these changes turn a slip [rad].
double Turned(const Vector& slip, int row, const std::vector<Vector>& changes) {
  double across = 0;
  for (const Vector& change : changes) {
    across += std::abs(slip(0) * change(row + 1) - slip(1) * change(row)) / slip.squaredNorm();
  }
  return across;
}

/// How closely the inequalities of a word have to hold, at least.
constexpr double kRestingBorder = 1e-10;
/// Slips, and rises of others, that are so many times what such bounces change go on in spite of
/// them; in space they may turn by so much [rad], by less where nothing tells of it.
constexpr double kGoesOn = 3, kTurns = 0.1, kTurnsUnseen = 1e-3;

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
  bounces_changes_.clear();
  bounces_last_ = 0;
  thrown_ = back;
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
    thrown_ = back;
    bounces_changes_.push_back(longest * acceleration);
    bounces_last_ += longest;
  }
}

void FrictionalResolution::TellOfRest(ConstraintSet pressed_back) {
  if (pressed_back.Empty()) return;
  result_.held_down = pressed_back;
  result_.held_interval = bounces_last_;
  const bool known = Notable() ? result_.transition.rest_impulse.size() > 0
                               : BouncesTurn().value_or(kTurns) <= kTurnsUnseen;
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

/// By how much slips in space turn at most [rad], where all contacts behind one touchdown have the
/// letters after it as often as they push, or end with them, however those that are pressed back
/// bounce: then what they come to depends on nothing else (BringToRest).
std::optional<double> FrictionalResolution::BouncesTurn() const {
  const Transition& cluster = result_.transition;
  const bool alone = cluster.activated.Size() == 1 && cluster.guards.size() == 1 &&
                     grazed_.Empty() && stopped_.Empty() && implied_.Empty() && halted_.Empty();
  if (!alone || !cluster.obstacle.ok() || resting_ != cluster.mode_after) return std::nullopt;
  const Vector now = terms_.jacobian * cluster.x_plus.tail(d_);
  std::vector<Vector> changes = bounces_changes_;
  changes.push_back(now - risen_);
  Vector change = Vector::Zero(now.size());
  double turned = 0;
  for (const Vector& one : changes) change += one.cwiseAbs();
  for (int i = 0; i < system_.num_constraints(); ++i) {
    if (system_.compliant().Contains(i)) continue;
    if (!cluster.mode_after.Contains(i)) {
      const bool near = std::abs(terms_.gap(i)) <= rules_.gap_tolerance;
      if (near && !(now(i) > kGoesOn * change(i))) return std::nullopt;
      continue;
    }
    const Friction& friction = system_.friction()[i];
    const bool rubs = friction.dimension > 0 && friction.coefficient > 0;
    if (!rubs || cluster.mode_after.LetterOf(i) == Letter::kStick) continue;
    const Vector slip = now.segment(friction.row, friction.dimension);
    const double changed = change.segment(friction.row, friction.dimension).norm();
    if (!(slip.norm() > kGoesOn * changed)) return std::nullopt;
    if (friction.dimension == 2) turned = std::max(turned, Turned(slip, friction.row, changes));
  }
  return turned <= kTurns ? std::optional<double>(turned) : std::nullopt;
}

void FrictionalResolution::Rest(const std::map<int, Eigen::Vector2d>& onsets) {
  Vector& x = result_.transition.x_plus;
  if (!Notable()) return MakeRest(system_, resting_, onsets, &x);
  const InverseInertia inertia(system_, x.head(nq_), x.tail(d_));
  const Vector v = x.tail(d_);
  const RestImpulse rest = BringToRest(system_, inertia, v, resting_);
  x.tail(d_) = rest.v_plus;
  Vector& impulse = result_.transition.rest_impulse;  // letters may be chosen anew
  const auto turned = rest.v_plus.allFinite() ? BouncesTurn() : std::nullopt;
  if (turned) {
    impulse = impulse.size() > 0 ? Vector(impulse + rest.impulse) : rest.impulse;
  } else {
    x.tail(d_) = v;
    impulse = Vector();
  }
  result_.transition.turned = turned.value_or(0);
  MakeRest(system_, resting_, onsets, &x);
  result_.transition.energy_lost +=
      KineticEnergy(inertia.mass(), v) - KineticEnergy(inertia.mass(), x.tail(d_));
  AddRestError(&dynamics_, thrown_, bounces_last_, x.tail(d_) - v, &result_.transition);
}

}  // namespace contact_flow
