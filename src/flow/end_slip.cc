// SPDX-License-Identifier: BSD-3-Clause
// How a Flow meets slips that become singular, or that end where its input changes.
#include <algorithm>
#include <utility>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/flow/flow.h"
#include "held_apart.h"
#include "singular_slip.h"

namespace contact_flow {
namespace {

/// Steps over a singular slip are repeated until they are as short as this, relative to max(1, t).
constexpr double kCrossing = 1e-10;

}  // namespace

/// Whether the slip becomes singular in the step that has just been made, to be approached.
bool Flow::CrossesSingularSlip(double length) const {
  return regular_slip_ && !regular_end_ && length > kCrossing * std::max(1.0, t_);
}

/// Where no step is small enough: the proposal is an impact at the node that ends a slip whose
/// force grows without bound. False where there is none.
bool Flow::EndSlipByImpact() {
  if (!system_.HasFriction()) return false;
  jam_ = ResolveJam(&dynamics_, t_, x_, mode_, Rules());
  if (!jam_) return false;
  x_end_ = x_;
  end_ = t_;
  trigger_ = *(mode_ - mode_.Sticking()).begin();
  return true;
}

bool Flow::EndSlips() {
  const ConstraintSet sliding = mode_.SlippingInPlane();
  if (sliding.Empty()) return false;
  const Vector v = x_.tail(system_.dof());
  dynamics_.Evaluate(x_, mode_);
  system_.Constraints(x_.head(system_.num_positions()), v, &terms_);
  // What integration leaves of it, but no more than what counts as rest: it is not taken away.
  const double resolved = options_.absolute_tolerance + options_.relative_tolerance * v.norm();
  for (int i : sliding) {
    const int guard = guards_.OfFriction(i);
    const GuardJet slip = guards_.OfMotion(guard, mode_, terms_, v, dynamics_.acceleration());
    const bool again = last_transition_ && *last_transition_ == t_ && last_trigger_ == guard;
    const double size = terms_.jacobian.row(system_.friction()[i].row).norm();
    const double rest = std::min(resolved * size, options_.speed_tolerance);
    if (!(slip.rate < 0) || slip.value > rest || again) continue;
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

/// The transition at the event of the proposal. A slip whose force ends in a pole has jammed.
ResolvedTransition Flow::ResolveAtEvent() {
  if (!system_.HasFriction()) {
    return ResolveTransition(&dynamics_, t_, x_, mode_, trigger_, Rules());
  }
  if (jam_) return *std::exchange(jam_, std::nullopt);
  if (!apart_.Empty()) return ResolveHeldApart(&dynamics_, t_, x_, mode_, apart_, Rules());
  if (std::exchange(singular_slip_, false)) {
    return ResolveSingularSlip(&dynamics_, t_, x_, mode_, Rules());
  }
  ResolvedTransition resolved = ResolveFriction(&dynamics_, t_, x_, mode_, trigger_, Rules());
  const int i = guards_.ConstraintOf(trigger_);
  const bool pole = guards_.IsNormal(trigger_) && (mode_ - mode_.Sticking()).Contains(i) &&
                    resolved.transition.grazed.Contains(i);
  if (pole && resolved.transition.activated.Empty()) {
    if (auto jam = ResolveJam(&dynamics_, t_, x_, mode_, Rules())) return *jam;
  }
  return resolved;
}

}  // namespace contact_flow
