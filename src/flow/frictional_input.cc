// SPDX-License-Identifier: BSD-3-Clause
// Where nothing but the input changes, with friction.
#include <algorithm>
#include <cmath>

#include "frictional_resolution.h"
#include "guarded.h"

namespace contact_flow {

/// Those of `contacts` whose slips are not told from none: their signs are no directions, and the
/// next input decides whether they go on.
ConstraintSet FrictionalResolution::UnresolvedSlips(ConstraintSet contacts) const {
  const Vector v = result_.transition.x_minus.tail(d_);
  ConstraintSet slow;
  for (int i : contacts) {
    const Friction& friction = system_.friction()[i];
    if (friction.dimension == 0) continue;
    const double row = terms_.jacobian.row(friction.row).norm();
    const double rest = std::max(UnresolvedSlip(rules_, row, v.norm()), SlipRounding(friction, v));
    if (rate_.segment(friction.row, friction.dimension).norm() <= rest) slow.Insert(i);
  }
  return slow;
}

/// Contacts that have let go and not risen to what the integration resolves, their speeds being
/// worth no word, and that the next input presses back: they have not left.
ConstraintSet FrictionalResolution::Unrisen(const TouchingContacts& contacts) {
  const double slow = kNotable * rules_.speed_tolerance;
  ConstraintSet rising;
  for (int i : ConstraintSet::All(system_.num_constraints()) - contacts.still -
                   contacts.slipping.Members()) {
    const bool near = std::abs(terms_.gap(i)) <= rules_.reach_tolerance;
    if (near && std::abs(rate_(i)) <= slow) rising.Insert(i);
  }
  return PressedBack({rate_, rising, {}, {}, contacts}, Unfollowed::kUnresolved);
}

void FrictionalResolution::DecideInput() {
  TouchingContacts contacts;
  const Vector v = result_.transition.x_minus.tail(d_);
  const ContactMode mode = result_.transition.mode_before;
  unresolved_ = UnresolvedSlips(mode.SlippingInPlane());
  const ConstraintSet still = mode.Sticking() | unresolved_;
  for (int i = 0; i < system_.num_constraints(); ++i) {
    const bool touches =
        std::abs(terms_.gap(i)) <= rules_.gap_tolerance && std::abs(rate_(i)) <= RestRounding(i, v);
    if (mode.Contains(i) || touches) Sort(i, rate_, v, still, &contacts);
  }
  contacts.before = mode;
  const ConstraintSet back = Unrisen(contacts);
  if (back.Empty()) {
    SetLettersOrEndSlip(contacts);
  } else {
    const ResolvedTransition begun = result_;
    TouchingContacts with = contacts;
    for (int i : back) Sort(i, rate_, v, UnresolvedSlips(back), &with);
    try {
      SetLettersOrEndSlip(with);
    } catch (const FrictionRefusal&) {
      result_ = begun;
      SetLettersOrEndSlip(contacts);
    }
  }
  result_.transition.touching = result_.transition.mode_after - mode;
}

ResolvedTransition ResolveFrictionalInput(ContactDynamics* dynamics, double t, const Vector& x,
                                          ContactMode mode, const TransitionRules& rules) {
  FrictionalResolution resolution(dynamics, t, x, mode, rules);
  const Status status = Guarded(t, [&] { resolution.DecideInput(); });
  ResolvedTransition result = resolution.Take();
  result.status = status;
  result.transition.changes_input = true;
  result.transition.released = mode - result.transition.mode_after;
  return result;
}

}  // namespace contact_flow
