// SPDX-License-Identifier: BSD-3-Clause
// How often an EventLocator looks at gaps above narrow surfaces.
#include <algorithm>

#include "contact_flow/flow/event_locator.h"
#include "step_constants.h"

namespace contact_flow {
namespace {

/// A contact is clear of its surface where it would have to be this much faster on the way than at
/// both ends of the step to reach it.
constexpr double kPassageReserve = 1.5;

/// From `first` to the surface and back to `last` the way is longer than the contact goes in h.
bool IsClearOf(const Clearance& first, const Clearance& last, double h) {
  return first.distance + last.distance > kPassageReserve * h * std::max(first.speed, last.speed);
}

}  // namespace

/// How many pieces of the step each gap asks for; false, with `event`, where the step is too long.
bool EventLocator::ScreenPassages(LocatedEvent* event) {
  const int nq = dynamics_->system().num_positions(), d = dynamics_->system().dof();
  const auto look = [&](const Vector& x, std::vector<SurfacePassage>* passages) {
    narrow_->Passages(x.head(nq), x.tail(d), passages);
  };
  if (!knows_begin_) look(stepper_->begin(), &passages_begin_);
  look(stepper_->end(), &passages_end_);
  knows_begin_ = knows_end_ = true;
  looks_.setZero();
  const double h = stepper_->step();
  double most = 0;
  int narrowest = -1;
  for (int i : guards_.OfGaps(mode_) - ignored_) {
    const auto k = static_cast<std::size_t>(i);
    const SurfacePassage &first = passages_begin_[k], &last = passages_end_[k];
    const double looks = kLooks * h * std::max(first.pace, last.pace);
    if (!(looks > 1) || IsClearOf(first.above, last.above, h)) continue;
    if (IsClearOf(first.beside, last.beside, h)) continue;
    looks_(i) = looks;
    if (looks > most) narrowest = i;
    most = std::max(most, looks);
  }
  const double part = GuardSearch::kMaxPieces / most;
  if (part < 1) *event = {false, part, narrowest};
  if (part >= 1) event->growth = std::min(event->growth, std::max(1.0, kLargestPart * part));
  return part >= 1;
}

}  // namespace contact_flow
