// SPDX-License-Identifier: BSD-3-Clause
// Slips in space that a transition leaves too slow to be followed.
#include <algorithm>

#include "frictional_resolution.h"
#include "src/dynamics/slips_in_space.h"

namespace contact_flow {
namespace {

/// A slip in space that would turn, or end, within this time, relative to max(1, t), is none: steps
/// take a part of it.
constexpr double kSlipTime = 1e-13;

}  // namespace

/// Slips in space that are too slow to be followed are none: others have ended them, or they end
/// here by themselves.
void FrictionalResolution::SetLetters(const TouchingContacts& contacts) {
  const ResolvedTransition before = result_;
  TouchingContacts now = contacts;
  while (true) {
    onset_ = 0;
    SetLettersAsRested(now);
    const ConstraintSet ended = TooSlow(now.slipping, before.transition.x_plus);
    if (ended.Empty()) return;
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
