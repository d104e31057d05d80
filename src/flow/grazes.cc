// SPDX-License-Identifier: BSD-3-Clause
// How a Flow notices gaps that graze at the very instant of another event: there no step tells of
// their turn, which lies between two arcs.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "contact_flow/flow/flow.h"
#include "guarded.h"
#include "src/dynamics/coordinate_reach.h"
#include "step_constants.h"
#include "thrown_down.h"

namespace contact_flow {
namespace {

/// Rounding of a rate Da_i v, relative to its terms.
constexpr double kRateNoise = 1e-12;
/// Accelerations of gaps below this part of their terms may be none.
constexpr double kAccelerationNoise = 1e-9;
/// Forces on both sides of a compliant constraint that differ by less, relative, are the same.
constexpr double kSameForce = 1e-9;

/// The middle of the quintic through both ends of a step of length h.
double Middle(double h, const GuardJet& begin, const GuardJet& end) {
  return 0.5 * (begin.value + end.value) + h * 5 / 32 * (begin.rate - end.rate) +
         h * h / 64 * (begin.acceleration + end.acceleration);
}

/// The curvature of a gap that is noise.
double NoiseOf(const ConstraintTerms& terms, int i, const VectorRef& acceleration) {
  return kAccelerationNoise *
         (terms.jacobian.row(i).cwiseAbs().dot(acceleration.cwiseAbs()) + std::abs(terms.bias(i)));
}

}  // namespace

/// Whether gap i is near above its floor, and does not fall to speak of.
bool Flow::StandsNear(int i) const {
  const double floor = options_.absolute_tolerance;
  const GuardJet at = guards_.OfMotion(i, mode_, gaps_begin_);
  if (at.value > kTouchReach * floor) return false;
  return at.rate >= 0 ||
         at.rate * at.rate <= 2 * kStandsStill * floor * std::max(at.acceleration, 0.0);
}

/// The gaps that begin an arc within their floors, or where they have just touched: below, or near
/// above with no speed to speak of. But for those that come down to it from above and open again by
/// themselves: they are about to graze.
ConstraintSet Flow::LowAtBegin() const {
  ConstraintSet low = locator_.Low(gaps_begin_);
  if (steps_ == 0) return low;
  const ContactMode rigid = mode_.Without(system_.compliant());
  const ConstraintSet touched = guard_margins_.low;
  if (touched != low) {
    for (int i : touched - low - rigid) {
      if (gaps_begin_.gap(i) < 0 || StandsNear(i)) low.Insert(i);
    }
  }
  const auto acceleration = stepper_->begin_field().tail(system_.dof());
  for (int i : low - touched - rigid) {
    const GuardJet at = guards_.OfMotion(i, mode_, gaps_begin_);
    if (at.rate < 0 && at.acceleration > NoiseOf(terms_, i, acceleration)) low.Erase(i);
  }
  return low;
}

/// A contact that has touched and that another impact throws down again, yet which its acceleration
/// turns back before it is below its floor, where no guard tells of it: it is hit, or −1.
int Flow::ThrownDown() const {
  for (int i : guard_margins_.low - mode_ - system_.compliant() - implied_.constraints()) {
    if (IsThrownDown(gaps_begin_, i, options_.speed_tolerance)) return i;
  }
  return -1;
}

/// What touched at the transition that was passed: its gap is not above its floor from then on.
void Flow::RememberTouched() {
  const Transition& passed = transition_;
  guard_margins_.low = guard_margins_.low | passed.mode_before | passed.mode_after |
                       passed.activated | passed.grazed | passed.touching | passed.switched |
                       passed.implied;
}

/// Notes the contacts that graze where a transition was passed that is none of theirs: they come
/// down to their surfaces, as far as gaps are known, with no more speed than what their
/// acceleration, which opens them again, turns on the way. `stepped`: a step led here; else it was
/// accepted as a whole before, and gaps_begin_ is of its end. Where an arc has only begun, they
/// were noted at the transition before.
void Flow::NoteGrazes(bool stepped) {
  if (steps_ > 0 && !new_arc_ && status_.ok()) {
    const ConstraintSet pressed = transition_.touching & transition_.mode_after;
    const ConstraintSet others = transition_.activated | transition_.grazed | pressed |
                                 transition_.switched | transition_.implied |
                                 implied_.constraints();
    const Vector& x = transition_.x_minus;
    const Vector v = x.tail(system_.dof());
    const Vector acceleration =
        (stepped ? stepper_->end_field() : stepper_->begin_field()).tail(system_.dof());
    SampleGaps(system_, x, acceleration, &terms_, &gaps_end_);
    const auto q = x.head(system_.num_positions());
    for (int i : guards_.OfGaps(transition_.mode_before) - others) {
      const auto row = terms_.jacobian.row(i);
      const double floor =
          std::max(options_.absolute_tolerance, kGapNoise * ReachAlong(row, system_.space(), q));
      if (!(std::abs(gaps_end_.gap(i)) <= kTouchReach * floor)) continue;
      const double noise = NoiseOf(terms_, i, acceleration);
      const double rounding = kRateNoise * row.cwiseAbs().dot(v.cwiseAbs());
      if (Grazes(i, stepped, floor, noise, rounding)) NoteGraze(i);
    }
  }
  RememberTouched();
}

/// Whether gap i, which is near zero at the end of the arc, was above it and is turned there.
bool Flow::Grazes(int i, bool stepped, double floor, double noise, double rounding) const {
  const GuardJet end = guards_.OfMotion(i, transition_.mode_before, gaps_end_);
  double begin_rate = 0, highest = end.value;  // of the step
  if (stepped) {
    const GuardJet begin = guards_.OfMotion(i, transition_.mode_before, gaps_begin_);
    highest = Middle(stepper_->step(), begin, end);
    const bool rose = highest > kTouchReach * floor;
    begin_rate = rose ? -1 : begin.rate;
    if (guard_margins_.low.Contains(i) && !rose) return false;
    highest = std::max(highest, begin.value);
  } else if (guard_margins_.low.Contains(i)) {
    return false;
  }
  if (end.rate > 0 && !(begin_rate < 0)) return false;  // it is on its way up
  const bool opens = end.acceleration > noise;
  const bool falls_on = end.acceleration < -noise;
  if (!opens && (falls_on || !(highest > kTouchReach * floor))) return false;
  const double turned = std::sqrt(2 * std::abs(end.acceleration) * floor);
  if (std::abs(end.rate) <= std::max(std::min(options_.speed_tolerance, turned), rounding)) {
    return true;
  }
  // Its turn was ahead, within what is known of the gap, and something else has turned it.
  const double sign = Guards::GapSign(i, transition_.mode_before);
  const double after = sign * terms_.jacobian.row(i).dot(transition_.x_plus.tail(system_.dof()));
  const double jump = std::abs(after - end.rate);
  const bool ahead =
      end.rate < 0 && end.rate * end.rate <= 2 * end.acceleration * (end.value + floor);
  return opens && ahead && jump > options_.speed_tolerance;
}

void Flow::NoteGraze(int i) {
  if (system_.compliant().Contains(i)) {  // a force that grows from zero does not feel it
    const ContactMode mode = transition_.mode_before;
    bool same = false;
    const Status known = Guarded(t_, [&] {
      const Vector here = dynamics_.Field(transition_.x_minus, mode);
      const ContactMode other = mode.Contains(i) ? mode.Without(i) : mode.With(i);
      const Vector there = dynamics_.Field(transition_.x_minus, other);
      same = (there - here).cwiseAbs().maxCoeff() <=
             kSameForce * std::max(here.cwiseAbs().maxCoeff(), there.cwiseAbs().maxCoeff());
    });
    if (known.ok() && same) return;
  }
  std::ostringstream message;
  message.precision(12);
  message << "constraint '" << system_.description().constraints[static_cast<std::size_t>(i)]
          << "' is touched at t = " << t_
          << " s, where something else happens, with normal velocity " << gaps_end_.rate(i)
          << " m/s: grazing, not admissible";
  Warn(Outcome::kGrazing, message.str());
  transition_.grazed.Insert(i);
  if (transition_.obstacle.ok()) transition_.obstacle = {Outcome::kGrazing, message.str()};
  margins_.approach_speed = 0;
}

}  // namespace contact_flow
