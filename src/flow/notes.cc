// SPDX-License-Identifier: BSD-3-Clause
// What a Flow notes on its way, of events that nearly happened and of work, and tells of a run.
#include <algorithm>

#include "contact_flow/flow/flow.h"
#include "step_constants.h"

namespace contact_flow {

/// The forces of the step that is accepted.
void Flow::NoteForces() {
  locator_.PassForces(&force_minima_);
  guard_margins_.force = std::min(guard_margins_.force, force_minima_.lowest());
}

/// A step that was cut short, of `error`: the longer one was looked at, and its minima may lie
/// behind the cut.
void Flow::NoteCutStep(double error) {
  SampleEnd(&gaps_end_);
  const LocatedEvent event =
      locator_.Locate(stepper_, mode_, gaps_begin_, gaps_end_, error < kFreeError);
  if (!event.found) {
    guard_margins_.gap = std::min(guard_margins_.gap, locator_.margins().gap);
    guard_margins_.force = std::min(guard_margins_.force, locator_.margins().force);
  }
  NoteForces();
}

void Flow::FollowStopped() { stopped_gaps_.Follow(gaps_begin_, &guard_margins_.gap); }

Margins Flow::margins() const {
  Margins margins = margins_;
  margins.gap = guard_margins_.gap;
  margins.force = guard_margins_.force;
  return margins;
}

RunStatistics Flow::statistics() const {
  return {dynamics_.evaluations(), steps_, attempts_ - steps_, implicit_steps_,
          implicit_ ? implicit_->jacobians() : 0};
}

}  // namespace contact_flow
