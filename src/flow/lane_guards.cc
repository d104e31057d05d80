// SPDX-License-Identifier: BSD-3-Clause
// How the runs in lanes look for events: as EventLocator does, which is asked where a look at the
// ends and the stages does not do.
#include <algorithm>

#include "contact_flow/flow/guard_interpolant.h"
#include "lane_runs.h"
#include "step_constants.h"

namespace contact_flow {

/// Whether the ends and stages of the step tell that nothing vanishes in it, as they do where
/// EventLocator looks no further.
bool LaneRuns::IsClear(int k, bool free) {
  Lane& run = lane(k);
  if (free && !run.mode.Empty()) return false;
  const int end = StagePlaces::OfDop853().end;
  for (int i : run.mode) {
    double lowest = Force(0, i, k), highest = lowest;
    for (int place = 1; place <= end; ++place) {
      lowest = std::min(lowest, Force(place, i, k));
      highest = std::max(highest, Force(place, i, k));
    }
    if (!(lowest > kForceReserve * (highest - lowest))) return false;
    if (lowest < Force(0, i, k) && lowest < Force(end, i, k)) {
      run.next_margins.force = std::min(run.next_margins.force, lowest);
    }
  }
  for (int i = 0; i < n_; ++i) {
    if (run.mode.Contains(i)) continue;
    const GuardBound bound =
        QuinticBound(run.length, {run.begin.gap(i), run.begin.rate(i), run.begin.acceleration(i)},
                     {end_.gap(i), end_.rate(i), end_.acceleration(i)});
    const bool dips = run.begin.rate(i) < 0 && end_.rate(i) > 0;
    if (!(bound.lowest > bound.error && bound.lowest > options_.absolute_tolerance)) return false;
    if (dips && bound.lowest - bound.error < run.margins.gap) return false;
  }
  return true;
}

LocatedEvent LaneRuns::Locate(int k, bool free) {
  Lane& run = lane(k);
  Use(run);
  view_.Load(k);
  locator_.RestoreMargins(run.margins);
  locator_.BeginArc();
  if (!run.mode.Empty()) {
    dynamics_.Evaluate(view_.end(), run.mode);  // its factors are asked for
    for (int place = 0; place <= StagePlaces::OfDop853().end; ++place) {
      for (int i = 0; i < n_; ++i) force_(i) = Force(place, i, k);
      locator_.RecordForce(force_, run.mode);
    }
  }
  const long before = dynamics_.evaluations();
  const LocatedEvent event = locator_.Locate(&view_, run.mode, run.begin, end_, free);
  run.evaluations += dynamics_.evaluations() - before + (view_.extended() ? 3 : 0);
  run.next_margins = locator_.margins();
  return event;
}

}  // namespace contact_flow
