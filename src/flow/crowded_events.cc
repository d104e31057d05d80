// SPDX-License-Identifier: BSD-3-Clause
// Events with friction that follow each other while nothing moves by what is resolved: feet that
// throw each other up, ever again, or slips that end as they begin.
#include <algorithm>
#include <cmath>
#include <utility>

#include "contact_flow/flow/flow.h"
#include "settled_together.h"
#include "step_constants.h"

namespace contact_flow {
namespace {

/// So many times in a row, each within this time of the one before, relative to max(1, t).
constexpr int kMostSettles = 16;
constexpr double kSettledFor = 1e-6;

}  // namespace

/// What the contacts that this transition changes have moved by since the one before.
void Flow::CountCrowd(const Transition& next) {
  const int d = system_.dof();
  system_.Constraints(next.x_minus.head(system_.num_positions()), next.x_minus.tail(d), &terms_);
  ConstraintSet changed = next.activated | next.grazed;
  for (int i : next.mode_before | next.mode_after) {
    if (next.mode_before.LetterOf(i) != next.mode_after.LetterOf(i)) changed.Insert(i);
  }
  double fastest = 0;
  for (const Vector& x : {next.x_minus, transition_.x_plus}) {
    if (x.size() == 0) continue;
    const Vector rate = terms_.jacobian * x.tail(d);
    for (int i : changed) {
      const Friction& friction = system_.friction()[i];
      const double slip = rate.segment(friction.row, friction.dimension).norm();
      fastest = std::max({fastest, std::abs(rate(i)), slip});
    }
  }
  crowd_moved_ += fastest * (t_ - last_transition_.value_or(t_));
  if (crowd_moved_ > options_.gap_tolerance) crowd_ = 0;
  if (crowd_ == 0) crowd_moved_ = 0;
  ++crowd_;
}

/// Whether events that were ended so have come again without time between them, or many times with
/// hardly any: they are not ended once more.
bool Flow::CrowdsAgain() const {
  const double since = (t_ - settled_) / std::max(1.0, std::abs(t_));
  return since <= kLongestStall || (settles_ >= kMostSettles && since <= kSettledFor);
}

/// Where there are half as many as end a run, or GoesOn would end it, all that touches is brought
/// to rest together at the first of them that lets it be.
void Flow::SettleCrowd(ResolvedTransition* resolved) {
  if (!system_.HasFriction()) return;
  CountCrowd(resolved->transition);
  const int most = LongestCrowd(system_.num_constraints());
  const bool ends = std::max(stalls_, idle_) > most;
  if (!(ends || crowd_ > most / 2) || CrowdsAgain()) return;
  auto settled = ResolveBySettling(&dynamics_, t_, x_, mode_, Rules(), Outcome::kChatter,
                                   "events follow each other while nothing moves");
  if (settled) *resolved = std::move(*settled);
  if (!settled && !ends && crowd_ < most) return;
  settles_ = t_ - settled_ <= kSettledFor * std::max(1.0, std::abs(t_)) ? settles_ + 1 : 1;
  crowd_ = stalls_ = idle_ = 0;
  settled_ = t_;
}

}  // namespace contact_flow
