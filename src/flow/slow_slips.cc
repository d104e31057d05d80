// SPDX-License-Identifier: BSD-3-Clause
// Slips in space that a transition leaves too slow to be followed.
#include <algorithm>
#include <cmath>

#include "frictional_resolution.h"
#include "slip_onset.h"
#include "src/dynamics/implied_contacts.h"
#include "src/dynamics/slips_in_space.h"

namespace contact_flow {
namespace {

/// A slip in space that would turn, or end, within this time, relative to max(1, t), is none: steps
/// take a part of it.
constexpr double kSlipTime = 1e-13;
/// A slip that begins dies where it is slowed by this part of what would move without contacts.
constexpr double kDies = 1e-3;

}  // namespace

double FrictionalResolution::SlipRounding(const Friction& friction, const Vector& v) const {
  double rounding = 0;
  for (int k = 0; k < friction.dimension; ++k) {
    rounding = std::max(rounding, RateRounding(friction.row + k, v));
  }
  return rounding;
}

/// Slips in space that are too slow to be followed are none: others have ended them, or they end
/// here by themselves.
void FrictionalResolution::SetLetters(const TouchingContacts& contacts) {
  const ResolvedTransition before = result_;
  TouchingContacts now = contacts;
  while (true) {
    onset_ = 0;
    SetLettersAsRested(now);
    const ConstraintSet ended = TooSlow(now.slipping, before.transition.x_plus);
    if (ended.Empty()) return StickWhatDies(now, before.transition.x_plus);
    result_ = before;
    for (int i : ended) {
      now.slipping.Erase(i);
      now.still.Insert(i);
    }
    if (!result_.transition.obstacle.ok()) continue;
    result_.transition.obstacle = {Outcome::kNotDifferentiable,
                                   "contacts " + ended.ToString(system_.description().constraints) +
                                       " slip too slowly in space to be told from rest: no "
                                       "derivative"};
  }
}

/// Slips in space that begin here, from the state `begin`, and that their own forces end at once:
/// their rows all but depend on those of what sticks, and no velocity has the directions in which
/// they are to begin. A body that rocks on parallel hinges passes such a posture, through which its
/// feet stick: they do, where their forces fit.
void FrictionalResolution::StickWhatDies(const TouchingContacts& contacts, const Vector& begin) {
  Transition& cluster = result_.transition;
  ConstraintSet dies = BeginInSpace(system_, contacts.still, cluster.mode_after);
  if (dies.Empty()) return;
  dynamics_.Evaluate(cluster.x_plus, ContactMode());
  const double free = (terms_.jacobian * dynamics_.acceleration() + terms_.bias).norm();
  dynamics_.Evaluate(cluster.x_plus, cluster.mode_after);
  const Vector rate = terms_.jacobian * cluster.x_plus.tail(d_);
  const Vector change = terms_.jacobian * dynamics_.acceleration() + terms_.bias;
  for (int i : dies) {
    const auto slip = rate.segment<2>(system_.friction()[i].row);
    const double along = slip.dot(change.segment<2>(system_.friction()[i].row));
    if (!(along < -kDies * free * slip.norm())) dies.Erase(i);
  }
  if (dies.Empty()) return;
  ContactMode stuck = cluster.mode_after;
  for (int i : dies) stuck.Set(i, Letter::kStick);
  Vector x = begin;
  MakeRest(system_, stuck, {}, &x);
  if (!ForcesFit(x, stuck)) return;
  cluster.mode_after = resting_ = stuck;
  cluster.x_plus = begin;
  Rest({});
  if (!cluster.obstacle.ok()) return;
  cluster.obstacle = {Outcome::kNotDifferentiable,
                      "contacts " + dies.ToString(system_.description().constraints) +
                          " stop in a posture in which they cannot slip: no derivative"};
}

/// Whether contact forces of a mode push, and those that stick are in their cones.
bool FrictionalResolution::ForcesFit(const Vector& x, ContactMode mode) const {
  dynamics_.Evaluate(x, mode);
  const Vector& force = dynamics_.force();
  for (int i : mode - system_.compliant()) {
    const Friction& friction = system_.friction()[i];
    if (!(force(i) >= 0)) return false;
    if (mode.LetterOf(i) != Letter::kStick || std::isinf(friction.coefficient)) continue;
    const double held = force.segment(friction.row, friction.dimension).norm();
    if (!(held <= friction.coefficient * force(i))) return false;
  }
  return true;
}

/// Those of `slips` in space whose directions no step could follow, or which are no faster than
/// those that begin beside them, and are turned by these.
ConstraintSet FrictionalResolution::TooSlow(ContactMode slips, const Vector& begin) const {
  const Transition& cluster = result_.transition;
  ConstraintSet slow = SlipsInSpace(system_, cluster.mode_after) & slips.Members();
  if (slow.Empty()) return slow;
  dynamics_.Evaluate(cluster.x_plus, cluster.mode_after);
  const Vector before = terms_.jacobian * begin.tail(d_);
  const Vector rate = terms_.jacobian * cluster.x_plus.tail(d_);
  const Vector change = terms_.jacobian * dynamics_.acceleration() + terms_.bias;
  const double time = kSlipTime * std::max(1.0, cluster.t);
  for (int i : slow) {
    const int row = system_.friction()[i].row;
    const bool turned = before.segment<2>(row).norm() <= onset_;
    const double least = time * change.segment<2>(row).norm();
    if (!turned && rate.segment<2>(row).norm() > least) slow.Erase(i);
  }
  return slow;
}

}  // namespace contact_flow
