// SPDX-License-Identifier: BSD-3-Clause
// Contacts that an impact throws up so little that they are pressed back before it can be seen.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "contact_flow/model/driven.h"
#include "frictional_resolution.h"
#include "rest_error.h"
#include "src/dynamics/coordinate_reach.h"
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
/// them; in space they may turn by so much [rad].
constexpr double kGoesOn = 3, kTurns = 0.35;

}  // namespace

/// How high a bounce [m] is not followed. Where a contact leaves its gap is zero, as far as it is
/// computed, and errors of the integration do not disturb that for so short a time. One with
/// restitution would bounce infinitely often.
double FrictionalResolution::Reach(int i, Unfollowed which) const {
  const bool bounces_on = system_.restitution()(i) > 0;
  if (which == Unfollowed::kUnresolved || bounces_on) return rules_.reach_tolerance;
  const VectorRef q = result_.transition.x_plus.head(nq_);
  const double known = kUnits * ReachAlong(terms_.jacobian.row(i), system_.space(), q);
  return std::min(rules_.reach_tolerance, std::max(known, std::abs(terms_.gap(i))));
}

/// Those that leave and that the motion of the others presses back before they have risen to their
/// Reach: a touchdown that follows is where they are, and each throws another one up. They rest,
/// and may press back further ones. The state is that after the impact.
ConstraintSet FrictionalResolution::PressedBack(const LeftByImpact& left, Unfollowed which) {
  ConstraintSet back, still = left.still;
  if (left.leaving.Empty()) return back;
  const Vector& x = result_.transition.x_plus;
  const Vector v = x.tail(d_);
  const Vector& rate = left.rate;
  TouchingContacts resting = left.contacts;
  risen_ = rate;
  bounces_changes_.clear();
  bounces_last_ = fastest_rise_ = 0;
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
    for (int i : left.leaving - before) {
      if (!(rate(i) * rate(i) <= -2 * acceleration(i) * Reach(i, which))) continue;
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

/// Whether one of them, which was hit and leaves, approaches again, as others were made rest.
bool FrictionalResolution::TurnsBack(ConstraintSet hit) const {
  const Vector v = result_.transition.x_plus.tail(d_);
  for (int i : hit) {
    if (terms_.jacobian.row(i).dot(v) < -Rounding(i, v)) return true;
  }
  return false;
}

/// Slips that bounces change as much as they are end while these last. Where their contacts then
/// stick, the velocity is that at which all of them do, whatever the bounces were. False, and
/// nothing is done, where one goes on.
bool FrictionalResolution::StopSlow(const TouchingContacts& contacts) {
  TouchingContacts stopped = contacts;
  for (int i : contacts.slipping) {
    const Friction& friction = system_.friction()[i];
    if (friction.dimension == 0 || friction.coefficient == 0) continue;
    double change = 0;
    for (const Vector& bounce : bounces_changes_) {
      change += bounce.segment(friction.row, friction.dimension).norm();
    }
    if (!(risen_.segment(friction.row, friction.dimension).norm() <= kGoesOn * change)) continue;
    stopped.slipping.Erase(i);
    stopped.still.Insert(i);
  }
  const ConstraintSet slow = stopped.still - contacts.still;
  if (slow.Empty()) return false;
  const ResolvedTransition before = result_;
  const double last = bounces_last_;
  bounces_last_ *= 1 + kGoesOn;
  try {
    SetLettersOrEndSlip(stopped);
    if ((slow - result_.transition.mode_after.Sticking()).Empty()) return true;
  } catch (const FrictionRefusal&) {
  }
  bounces_last_ = last;
  result_ = before;
  return false;
}

/// Letters and rest behind an impact. False where what was made rest depends on bounces that are
/// not followed.
bool FrictionalResolution::RestPressedBack(const LeftByImpact& left, Unfollowed which) {
  Transition& cluster = result_.transition;
  const bool known = cluster.obstacle.ok();
  TouchingContacts contacts = left.contacts, without = left.contacts;
  ConstraintSet still = left.still, back = PressedBack(left, which);
  const Vector v = cluster.x_plus.tail(d_);
  for (int i : back) SortRising(i, left.rate, v, left.rate(i), &still, &contacts);
  ended_ = back & contacts.still;
  // The same event at the same time: what would let go does.
  for (int i : rules_.stalled ? cluster.vanishing : ConstraintSet()) {
    for (TouchingContacts* all : {&contacts, &without}) {
      all->still.Erase(i);
      all->slipping.Erase(i);
    }
  }
  const Transition decided = cluster;
  const auto let_rise = [&] {
    cluster = decided;
    back = ended_ = thrown_ = ConstraintSet();
    SetLettersOrEndSlip(without);
  };
  try {
    const bool stopping = which == Unfollowed::kUnseenStopping && !back.Empty();
    if (!stopping || !StopSlow(contacts)) SetLettersOrEndSlip(contacts);
    const ConstraintSet hit = left.bouncing | (cluster.activated - cluster.mode_after);
    if (!back.Empty() && TurnsBack(hit)) let_rise();
  } catch (const FrictionRefusal&) {
    if (back.Empty()) throw;
    let_rise();  // the slips of a rise may fit no word
  }
  TellOfRest(back & cluster.mode_after);
  return back.Empty() || !known || cluster.obstacle.ok();
}

/// Bounces that integration does not resolve are made rest where what they come to depends on
/// nothing else. Others are followed, if the velocity behind those that cannot be is known then.
void FrictionalResolution::RestOrFollow(const LeftByImpact& left) {
  const ResolvedTransition begun = result_;
  if (RestPressedBack(left, Unfollowed::kUnresolved) || rules_.stalled) return;
  const ResolvedTransition rested = result_;
  for (const Unfollowed which : {Unfollowed::kUnseen, Unfollowed::kUnseenStopping}) {
    result_ = begun;
    try {
      if (RestPressedBack(left, which)) return;
    } catch (const FrictionRefusal&) {
    }
  }
  result_ = rested;
}

void FrictionalResolution::TellOfRest(ConstraintSet pressed_back) {
  if (pressed_back.Empty()) return;
  result_.held_down = pressed_back;
  result_.held_interval = bounces_last_;
  const bool known = result_.transition.rest_impulse.size() > 0;
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

/// Those that rest do so from the velocity that an impact has left: by what they bounce until
/// then, where that decides it. It may be asked again, with other letters.
void FrictionalResolution::Rest(const std::map<int, Eigen::Vector2d>& onsets) {
  Transition& cluster = result_.transition;
  Vector& x = cluster.x_plus;
  if (thrown_.Empty()) return MakeRest(system_, resting_, onsets, &x);
  const InverseInertia inertia(system_, x.head(nq_), struck_);
  const RestImpulse rest = BringToRest(system_, inertia, struck_, resting_);
  x.tail(d_) = rest.v_plus;
  const auto turned = rest.v_plus.allFinite() ? BouncesTurn() : std::nullopt;
  if (!turned) x.tail(d_) = struck_;
  cluster.rest_impulse = turned ? rest.impulse : Vector();  // [n+l+r]
  cluster.turned = turned.value_or(0);
  MakeRest(system_, resting_, onsets, &x);
  cluster.energy_lost =
      KineticEnergy(inertia.mass(), struck_) - KineticEnergy(inertia.mass(), x.tail(d_));
  cluster.rest_error = Vector();
  AddRestError(&dynamics_, thrown_, bounces_last_, x.tail(d_) - struck_, &cluster);
}

}  // namespace contact_flow
