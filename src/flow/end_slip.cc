// SPDX-License-Identifier: BSD-3-Clause
// How a Flow meets slips that become singular, or that end where its input changes.
#include <algorithm>
#include <utility>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/flow/flow.h"
#include "held_apart.h"
#include "resolution.h"
#include "settled_together.h"
#include "singular_slip.h"
#include "src/dynamics/coordinate_reach.h"

namespace contact_flow {
namespace {

/// Steps over a singular slip are repeated until they are as short as this, relative to max(1, t).
constexpr double kCrossing = 1e-10;
/// A look ahead moves the state by this part of its size.
constexpr double kLookAhead = 1e-6;

/// Whether a slip that is none yet, or no longer, falls a little later as well: it ends. One that
/// has only just begun has no acceleration but rounding, and gains some.
bool FallsOn(int guard, const Guards& guards, ContactMode mode, const Vector& x,
             ContactDynamics* dynamics) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions();
  const Vector field = dynamics->Field(x, mode).head(2 * d);
  const double ahead = kLookAhead * TimeToMove(system.space(), x, field);
  const Vector later = system.Perturb(x, ahead * field);
  dynamics->Evaluate(later, mode);
  ConstraintTerms terms;
  system.Constraints(later.head(nq), later.tail(d), &terms);
  return guards.OfMotion(guard, mode, terms, later.tail(d), dynamics->acceleration()).rate < 0;
}

}  // namespace

/// Where the arc ends.
void Flow::NoteSlipRegularity() {
  if ((mode_ - mode_.Sticking()).Empty()) return;
  dynamics_.Evaluate(x_, mode_);
  margins_.painleve = std::min(margins_.painleve, dynamics_.slip_regularity());
}

/// Whether the slip becomes singular in the step that has just been made, to be approached.
bool Flow::CrossesSingularSlip(double length) const {
  return !(regular_slip_ < 0) && regular_end_ < 0 && length > kCrossing * std::max(1.0, t_);
}

/// Where no step is small enough: the proposal is a transition at the node, most often an impact
/// that ends a slip whose force grows without bound. False where there is none.
bool Flow::EndSlipAtNode() {
  if (!system_.HasFriction() || (mode_ - mode_.Sticking()).Empty()) return false;
  jam_ = ResolveUnresolvedSlip(&dynamics_, t_, x_, mode_, Rules());
  if (!jam_) {
    jam_ = ResolveBySettling(&dynamics_, t_, x_, mode_, Rules(), Outcome::kPainleveCrossing,
                             "no step size is small enough");
  }
  if (!jam_) return false;
  x_end_ = x_;
  end_ = t_;
  trigger_ = *(mode_ - mode_.Sticking()).begin();
  quick_next_ = {};  // what was quick here is over
  return true;
}

bool Flow::EndSlips() {
  const ConstraintSet sliding = mode_.SlippingInPlane();
  if (sliding.Empty()) return false;
  const Vector v = x_.tail(system_.dof());
  dynamics_.Evaluate(x_, mode_);
  const Vector acceleration = dynamics_.acceleration();
  system_.Constraints(x_.head(system_.num_positions()), v, &terms_);
  for (int i : sliding) {
    const int guard = guards_.OfFriction(i);
    const GuardJet slip = guards_.OfMotion(guard, mode_, terms_, v, acceleration);
    const bool again = last_transition_ && *last_transition_ == t_ && last_trigger_ == guard;
    const double size = terms_.jacobian.row(system_.friction()[i].row).norm();
    const double rest = UnresolvedSlip(options_, size, v.norm());  // it is not taken away
    if (!(slip.rate < 0) || slip.value > rest || again) continue;
    if (!FallsOn(guard, guards_, mode_, x_, &dynamics_)) continue;
    trigger_ = guard;
    const bool stepped = !arc_begun_;
    arc_begun_ = false;
    const bool passed = PassTransition();
    if (passed) NoteGrazes(stepped);
    new_arc_ = true;
    return passed;
  }
  return false;
}

/// The transition at the event of the proposal. A slip whose force ends in a pole has jammed; one
/// beside which no forces exist may be none that is told from rest.
ResolvedTransition Flow::ResolveAtEvent() {
  if (!system_.HasFriction()) {
    return ResolveTransition(&dynamics_, t_, x_, mode_, trigger_, Rules());
  }
  if (jam_) return *std::exchange(jam_, std::nullopt);
  if (!apart_.Empty()) return ResolveHeldApart(&dynamics_, t_, x_, mode_, apart_, Rules());
  if (std::exchange(singular_slip_, false)) {
    ResolvedTransition ended = ResolveSingularSlip(&dynamics_, t_, x_, mode_, Rules());
    if (ended.status.ok()) return ended;
    auto settled = ResolveBySettling(&dynamics_, t_, x_, mode_, Rules(), ended.status.outcome,
                                     "a slip becomes singular that nothing ends");
    return settled ? *settled : ended;
  }
  ResolvedTransition resolved = ResolveFriction(&dynamics_, t_, x_, mode_, trigger_, Rules());
  const Outcome outcome = resolved.status.outcome;
  const bool none =
      outcome == Outcome::kPainleveInconsistent || outcome == Outcome::kIndeterminateForces;
  if (none && resolved.transition.activated.Empty()) {
    if (auto other = ResolveUnresolvedSlip(&dynamics_, t_, x_, mode_, Rules())) return *other;
  }
  if (none) {
    auto settled = ResolveBySettling(&dynamics_, t_, x_, mode_, Rules(), outcome,
                                     "no motion of what touches fits");
    if (settled) return *settled;
  }
  const int i = guards_.ConstraintOf(trigger_);
  const bool pole = guards_.IsNormal(trigger_) && (mode_ - mode_.Sticking()).Contains(i) &&
                    resolved.transition.grazed.Contains(i);
  if (pole && resolved.transition.activated.Empty()) {
    if (auto jam = ResolveJam(&dynamics_, t_, x_, mode_, Rules())) return *jam;
  }
  return resolved;
}

}  // namespace contact_flow
