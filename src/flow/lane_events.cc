// SPDX-License-Identifier: BSD-3-Clause
// How the runs in lanes meet their events: as Flow does.
#include <algorithm>
#include <cmath>
#include <utility>

#include "lane_runs.h"
#include "step_constants.h"

namespace contact_flow {

/// A step onto the event was tried; see Flow::StepOntoEvent.
bool LaneRuns::SettleOnto(int k) {
  Lane& run = lane(k);
  run.evaluations += 12;
  view_.Load(k);
  x_end_ = view_.end();
  if (!x_end_.allFinite()) return false;
  if (run.redo) return EndOnto(k);
  LoadGaps(k, &end_);
  const int i = run.event.constraint;
  GuardJet at{};
  if (IsOfForces(guards_.KindOf(i, run.mode))) {
    Use(run);
    const long before = dynamics_.evaluations();
    at = guards_.At(i, &dynamics_, x_end_, run.mode);
    run.evaluations += dynamics_.evaluations() - before;
  } else {
    at = guards_.OfMotion(i, run.mode, end_);
  }
  const double value = run.event.touch ? at.rate : at.value;
  const double slope = run.event.touch ? at.acceleration : at.rate;
  if (std::abs(value) > run.least) {
    run.redo = true;
    run.s = arrays_.h[k] = run.nearest;
    return true;
  }
  run.nearest = run.s;
  run.least = std::abs(value);
  const double correction = slope != 0 ? -value / slope : 0;
  if (std::abs(correction) <= EulerReach(run.length) || !std::isfinite(correction)) {
    if (std::isfinite(correction)) {
      x_end_ += correction * view_.end_field();
      run.s += correction;
    }
    return EndOnto(k);
  }
  const double next = std::clamp(run.s + correction, 0.0, run.length);
  if (next == run.s || run.iteration + 1 == kMaxNewton) return EndOnto(k);
  ++run.iteration;
  run.s = arrays_.h[k] = next;
  return true;
}

bool LaneRuns::EndOnto(int k) {
  Lane& run = lane(k);
  const int i = run.event.constraint;
  if (run.mode.Contains(i)) {
    double largest = 0;
    for (int j = 0; j < n_; ++j) {
      if (run.mode.Contains(j)) largest = std::max(largest, std::abs(Force(12, j, k)));
    }
    const double before = Force(0, i, k), none = options_.relative_tolerance * largest;
    const bool falls = run.least <= std::max(kPhantom * before, none);
    const bool tells = run.length > kShortest * std::max(1.0, run.t);
    if (before > 0 && !falls && tells) return Repeat(k, kPhantomPart * run.length);
  }
  CountStep(k);
  view_.LoadTally(k, &arc_error_);
  run.t += std::max(run.s, 0.0);
  run.x = x_end_;
  NoteForces(k);
  run.margins = run.next_margins;
  run.quick_end = run.next_quick_end;
  run.quick_step = run.next_quick_step;
  if (!PassTransition(k)) return false;
  run.new_arc = true;
  if (!(run.t < request_.duration)) {
    Finish(k);
    return false;
  }
  return BeginArc(k) && Propose(k);
}

void LaneRuns::Warn(Lane* run, const Warning& warning) const {
  if (run->result.num_warnings++ >= Trajectory::kMaxWarnings) return;
  run->result.warnings.push_back({warning.code, run->t, warning.message});
}

bool LaneRuns::PassTransition(int k) {
  Lane& run = lane(k);
  const int trigger = run.event.constraint;
  ErrorTally error = run.start_error;
  error.Continue(run.t - run.arc_begin, arc_error_);
  const TransitionRules rules = {options_.simultaneity_tolerance,
                                 options_.speed_tolerance,
                                 options_.impact_law,
                                 options_.gap_tolerance,
                                 options_.absolute_tolerance,
                                 false,
                                 options_.relative_tolerance,
                                 options_.absolute_tolerance,
                                 error.error(),
                                 ConstraintSet()};
  // The same event at once again may be a stall.
  const bool again = run.last_transition && trigger == run.last_trigger &&
                     run.t - *run.last_transition <= kLongestStall;
  if (again || static_cast<long>(run.result.events.size()) >= options_.max_events) return false;
  run.last_trigger = trigger;
  Use(run);
  std::optional<ResolvedTransition> quick =
      run.event.touch ? std::nullopt
                      : touchdown_.Resolve(&dynamics_, run.t, run.x, run.mode, trigger, rules);
  const long before = dynamics_.evaluations() - (quick ? 1 : 0);  // ResolveTransition makes one
  ResolvedTransition resolved =
      quick ? *std::move(quick)
            : ResolveTransition(&dynamics_, run.t, run.x, run.mode, trigger, rules);
  if (!resolved.status.ok()) return false;
  Transition& transition = resolved.transition;
  Margins& margins = run.run_margins;
  margins.approach_speed = std::min(margins.approach_speed, resolved.approach_speed);
  margins.release_rate = std::min(margins.release_rate, resolved.release_rate);
  margins.cluster_spread = std::max(margins.cluster_spread, transition.spread);
  if (run.last_transition) {
    margins.event_interval = std::min(margins.event_interval, run.t - *run.last_transition);
  }
  for (const Warning& warning : resolved.warnings) Warn(&run, warning);
  run.last_transition = run.t;
  run.mode = transition.mode_after;
  run.force_minima->BeginArc(run.mode);
  run.x = transition.x_plus;
  if (!transition.grazed.Empty()) return false;
  if (!TallyTransition(k, transition) || Accumulates(k, resolved)) return false;
  run.evaluations += dynamics_.evaluations() - before;
  run.result.events.push_back(
      {run.t, transition.activated, transition.released, run.mode, std::move(transition.impulse)});
  const double held = static_cast<double>(run.result.events.size()) *
                      (sizeof(Arc) + sizeof(Transition) + 8.0 * (20.0 * d_ + 4.0 * n_));
  return held <= 1e6 * options_.max_megabytes;
}

/// False where a contact opens again that nearly touched, or may graze; or that stands near where
/// the next arc begins, see Flow::LowAtBegin.
bool LaneRuns::TallyTransition(int k, const Transition& transition) {
  Lane& run = lane(k);
  run.start_error = arc_error_;
  const Vector v_minus = transition.x_minus.tail(d_);
  system_.Constraints(transition.x_minus.head(d_), v_minus, &terms_);
  const ConstraintSet open =
      ConstraintSet::All(n_) - run.mode - transition.activated - transition.mode_before;
  for (int i : open) {
    if (!(terms_.gap(i) > kTouchReach * options_.absolute_tolerance)) return false;
  }
  const ConstraintSet touched = run.margins.low | transition.mode_before | transition.activated;
  for (int i : touched - run.mode) {
    const double gap = terms_.gap(i), floor = options_.absolute_tolerance;
    if (std::abs(gap) > floor && !(gap > kTouchReach * floor)) return false;
  }
  if (transition.activated.Empty()) return true;
  run.stopped->Impact(open, terms_, v_minus, run.x.tail(d_));
  Matrix rows(transition.activated.Size(), d_);
  Eigen::Index row = 0;
  for (int i : transition.activated) rows.row(row++) = terms_.jacobian.row(i);
  run.start_error.AddImpact(rows, rows * v_minus, transition.x_plus.tail(d_) - v_minus);
  return true;
}

/// Whether impacts accumulate, or a bounce is too low to be resolved.
bool LaneRuns::Accumulates(int k, const ResolvedTransition& resolved) {
  Lane& run = lane(k);
  const ConstraintSet impacts = resolved.transition.activated;
  if (impacts.Empty()) return false;
  if (run.zeno->Impact(impacts, run.t) || resolved.rest_interval > 0) return true;
  for (int i : impacts) {
    const double restitution = system_.restitution()(i);
    if (restitution <= 0 || restitution >= 1 || run.mode.Contains(i)) continue;
    dynamics_.Evaluate(run.x, run.mode);
    system_.Constraints(run.x.head(d_), run.x.tail(d_), &terms_);
    const double speed = terms_.jacobian.row(i).dot(run.x.tail(d_));
    const double back = -(terms_.jacobian.row(i).dot(dynamics_.acceleration()) + terms_.bias(i));
    if (speed < 0) continue;
    if (speed * speed <= 2 * back * options_.absolute_tolerance) return true;
  }
  return false;
}

}  // namespace contact_flow
