// SPDX-License-Identifier: BSD-3-Clause
// How a Flow ends a step exactly at an event.
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_flow/flow/flow.h"
#include "step_constants.h"

namespace contact_flow {

/// Newton's method for the event on the true step: repeats the step with its length as the unknown.
/// Sets x_end_ to the state at the event; returns its time after the beginning of the step, or
/// nothing where the guard of a force has hardly fallen there, or an implicit step is not solved.
std::optional<double> Flow::StepOntoEvent(const LocatedEvent& event, double length) {
  const std::optional<double> reached = StepOntoLevel(event, length, event.theta * length, 0);
  const ConstraintSet low = guards_.OfGaps(mode_) & locator_.margins().low;
  if (!reached || event.touch || !low.Contains(event.constraint)) return reached;
  const GuardJet begin = guards_.OfMotion(event.constraint, mode_, gaps_begin_);
  const double still = kStandsStill * options_.absolute_tolerance;
  const std::optional<double> level = LevelOfReturn(event.constraint, begin, *reached, length);
  if (!level) return reached;
  const std::optional<double> later = StepOntoLevel(event, length, length, *level);
  if (later && *later > *reached) {
    const GuardJet end = GapAtEnd(event.constraint);
    if (end.rate < 0 && std::abs(end.value - *level) <= still) return later;
  }
  return StepOntoLevel(event, length, event.theta * length, 0);
}

/// The same for the guard's passage of `level`, from a length s on.
std::optional<double> Flow::StepOntoLevel(const LocatedEvent& event, double length, double s,
                                          double level) {
  const int i = event.constraint;
  double nearest = s, least = std::numeric_limits<double>::infinity();
  const auto step_to = [&](double end) {
    locator_.BeginStep();
    stepper_->TryStep(end, options_.relative_tolerance, options_.absolute_tolerance);
    FinishStep();
    x_end_ = stepper_->end();
  };
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    step_to(s);
    if (!x_end_.allFinite()) return std::nullopt;
    GuardJet at{};
    if (IsOfForces(guards_.KindOf(i, mode_, dynamics_.shared()))) {
      at = guards_.At(i, &dynamics_, x_end_, mode_);
    } else {
      SampleEnd(&gaps_end_);
      at = guards_.OfMotion(i, mode_, gaps_end_);
    }
    const double value = event.touch ? at.rate : at.value - level;
    const double slope = event.touch ? at.acceleration : at.rate;
    if (std::abs(value) > least) {  // where the guard grazes, rounding sends Newton anywhere
      step_to(s = nearest);
      if (!x_end_.allFinite()) return std::nullopt;
      break;
    }
    nearest = s;
    least = std::abs(value);
    const double correction = slope != 0 ? -value / slope : 0;
    if (std::abs(correction) <= EulerReach(length) || !std::isfinite(correction)) {
      if (std::isfinite(correction)) {
        x_end_ += correction * stepper_->end_field();
        s += correction;
      }
      if (s > 0 && stepper_->step() == 0) {  // an arc that lasts has an extension
        const Vector there = x_end_;
        step_to(s);
        if (!x_end_.allFinite()) return std::nullopt;
        x_end_ = there;
      }
      break;
    }
    const double next = std::clamp(s + correction, 0.0, length);
    if (next == s || iteration + 1 == kMaxNewton) break;  // x_end_ is the state at s
    s = next;
  }
  if (guards_.OfForces(mode_, dynamics_.shared()).Contains(i)) {
    const double before = locator_.ForceAtBegin(i);
    const double none = options_.relative_tolerance * dynamics_.force().cwiseAbs().maxCoeff();
    const bool falls = least <= std::max(kPhantom * before, none);
    const bool tells = length > kShortest * std::max(1.0, t_);
    if (before > 0 && !falls && tells) return std::nullopt;
  }
  return std::max(s, 0.0);
}

/// The level at which a gap that begins the step below its surface has come back, where it passes
/// that nowhere, having let go within its floor below it: it is as low as it began. One that has
/// come back again and again at this time, its acceleration being none, falls first by what stands
/// still. Nothing for one that passes its surface at `reached`, and for one that has touched.
std::optional<double> Flow::LevelOfReturn(int i, const GuardJet& begin, double reached,
                                          double length) {
  if (!(begin.value < 0)) return std::nullopt;
  const double still = kStandsStill * options_.absolute_tolerance;
  if (reached > EulerReach(length)) {
    const bool turns = begin.rate > 0 && !(GapAtEnd(i).rate < 0);
    return turns ? std::optional(begin.value) : std::nullopt;
  }
  if (stalls_ >= kStallsToInsist && i == last_trigger_) return begin.value - still;
  const bool opens = begin.acceleration > 0;
  const bool slow = !(begin.rate < 0) || begin.rate * begin.rate <= 2 * still * begin.acceleration;
  return opens && slow ? std::optional(begin.value) : std::nullopt;
}

/// Of gap i at x_end_.
GuardJet Flow::GapAtEnd(int i) {
  SampleGaps(system_, x_end_, stepper_->end_field().tail(system_.dof()), &terms_, &gaps_end_);
  return guards_.OfMotion(i, mode_, gaps_end_);
}

}  // namespace contact_flow
