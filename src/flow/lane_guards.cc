// SPDX-License-Identifier: BSD-3-Clause
// How the runs in lanes look for events: as EventLocator does, which is asked where a look at the
// ends and the stages does not do.
#include <algorithm>
#include <cmath>

#include "guard_interpolant.h"
#include "lane_runs.h"
#include "resolution.h"
#include "step_constants.h"

namespace contact_flow {

bool LaneRuns::Drifts(int k) {
  const Lane& run = lane(k);
  const double least = kDrift * options_.absolute_tolerance;
  const double rate = std::max(least, kSlowDrift * options_.speed_tolerance);
  for (int i : run.mode) {
    if (std::abs(run.begin.rate(i)) > rate) return true;
    if (!(std::abs(run.begin.gap(i)) > least)) continue;
    double far = 0;
    for (int j = 0; j < d_; ++j) far = std::max(far, std::abs(At(arrays_.x, j, k)));
    if (std::abs(run.begin.gap(i)) > std::max(least, kUnits * far)) return true;
  }
  return false;
}

bool LaneRuns::Penetrates(const Lane& run) const {
  const double depth =
      std::max(kDeep * options_.gap_tolerance, kUnresolved * options_.absolute_tolerance);
  for (int i = 0; i < n_; ++i) {
    if (run.begin.gap(i) < -depth && !run.mode.Contains(i)) return true;
  }
  return false;
}

/// As EventLocator::Locate, which is not asked at each step: gaps that are far above their floors
/// where the step begins are low no longer.
void LaneRuns::ForgetLow(Lane* run) const {
  for (int i : run->margins.low) {
    const double above = Guards::GapSign(i, run->mode) * run->begin.gap(i);
    if (above > kTouchReach * options_.absolute_tolerance) run->margins.low.Erase(i);
  }
  run->next_margins.low = run->margins.low;
}

/// Whether the ends and stages of the step tell that nothing vanishes in it, as they do where
/// EventLocator searches nothing; `growth` is what the next step may be longer by.
bool LaneRuns::IsClear(int k, bool free, double* growth) {
  Lane& run = lane(k);
  ForgetLow(&run);
  if (!run.mode.Empty() && (free || !ForcesAreClear(k, growth))) return false;
  for (int i = 0; i < n_; ++i) {
    if (run.mode.Contains(i)) continue;
    const GuardJet first = guards_.OfMotion(i, run.mode, run.begin);
    const GuardJet last = guards_.OfMotion(i, run.mode, end_);
    const GuardBound bound = QuinticBound(run.length, first, last);
    if (!(bound.lowest > bound.error && bound.lowest > options_.absolute_tolerance)) return false;
    if (bound.dips && bound.lowest - bound.error < run.margins.gap) return false;
  }
  return true;
}

/// As EventLocator::ScreenForces.
bool LaneRuns::ForcesAreClear(int k, double* growth) {
  Lane& run = lane(k);
  const StagePlaces& places = StagePlaces::OfDop853();
  double largest = -1;
  for (int i : run.mode) {
    const double lowest = At(arrays_.low, i, k), range = At(arrays_.high, i, k) - lowest;
    if (lowest > kForceReserve * range) continue;
    if (largest < 0) largest = LargestForce(k);
    const double gain = run.maps->gain(i), h = run.length;
    const double floor = options_.relative_tolerance * largest / std::sqrt(gain) +
                         kQuietPull * 2 * options_.absolute_tolerance / (gain * h * h);
    const GuardBound bound =
        StageBound(places, arrays_.forces + i * width_ + k, n_ * width_, false);
    const double allowed = std::max(kForceResolved * range, floor);
    if (!(bound.error <= allowed) || lowest < -allowed) return false;
    const double part = bound.error / allowed;  // the error grows with the sixth power of the step
    constexpr double kNoLimit = 1e-5;           // steps grow by less than that allows
    if (part > kNoLimit) *growth = std::min(*growth, std::pow(part, -1.0 / 6));
    const double reach = std::min(bound.lowest, lowest) - bound.error;
    const bool deeper = bound.dips && reach < run.margins.force;
    if (reach <= floor || (deeper && lowest <= kForceMargin * range)) return false;
  }
  return true;
}

/// As Flow, of a step that is accepted.
void LaneRuns::NoteForces(int k) {
  Lane& run = lane(k);
  const StagePlaces& places = StagePlaces::OfDop853();
  for (int i : run.mode) {
    ForceMinima::Values values;
    for (std::size_t node = 0; node < values.size(); ++node) {
      values[node] = Force(places.nodes[node], i, k);
    }
    run.force_minima->Pass(i, places, values, options_.relative_tolerance);
  }
  run.next_margins.force = std::min(run.next_margins.force, run.force_minima->lowest());
}

/// max λ_i √G_ii over members and stages, what forces are rounded to.
double LaneRuns::LargestForce(int k) const {
  const Lane& run = lanes_[static_cast<std::size_t>(k)];
  double largest = 0;
  for (int i : run.mode) {
    const double force = std::max(-At(arrays_.low, i, k), At(arrays_.high, i, k));
    largest = std::max(largest, force * std::sqrt(run.maps->gain(i)));
  }
  return largest;
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
