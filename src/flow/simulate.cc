// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/simulate.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/mode_selection.h"
#include "contact_flow/dynamics/sticking.h"
#include "contact_flow/flow/dop853.h"
#include "contact_flow/flow/event_locator.h"
#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/flow/transition.h"
#include "contact_flow/flow/zeno_detector.h"
#include "thread_clock.h"

namespace contact_flow {
namespace {

constexpr double kSafety = 0.8;     // measured: shorter steps, but hardly a rejected one
constexpr double kFirstStep = 1.5;  // measured: the first guess is about half the step that follows
constexpr double kLargestGrowth = 6, kSmallestGrowth = 1.0 / 3;  // of the step size (Hairer's values)
constexpr double kSmallestStep = 1e-14;     // relative to max(1, t): nothing is resolved below
constexpr double kTaylorReach = 1e-9;       // [s] an event is moved this far by one Euler step: error ~1e-18
constexpr int kMaxNewton = 12;              // steps towards an event
constexpr int kStepsBetweenClockReadings = 64;

/// One run, from the initial state to the horizon or to the reason why it stopped.
class Run {
 public:
  Run(const MechanicalSystem& system, const InputSchedule& schedule, double duration,
      const SimulateOptions& options)
      : system_(system),
        schedule_(schedule),
        options_(options),
        duration_(duration),
        on_manifold_(HasStateManifold(system)),
        dynamics_(system, schedule.values.front()),
        locator_(&dynamics_, options.absolute_tolerance),
        zeno_(system.num_constraints(), options.zeno_interval),
        stepper_(system.state_size(), [this](const double* x, double* xdot) { Field(x, xdot); }) {}

  Trajectory Go(const VectorRef& x, ContactMode mode) {
    mode_ = mode;
    x_ = x;
    if (on_manifold_) ProjectState(system_, &x_);
    trajectory_.simultaneity_tolerance = options_.simultaneity_tolerance;
    while (FlowArc()) continue;
    trajectory_.margins.gap = locator_.gap_margin();
    trajectory_.margins.force = locator_.force_margin();
    trajectory_.statistics.field_evaluations = dynamics_.evaluations();
    return std::move(trajectory_);
  }

 private:
  void Field(const double* x, double* xdot) {
    const int d = system_.dof(), nq = system_.num_positions();
    dynamics_.Evaluate(Eigen::Map<const Vector>(x, nq + d), mode_);
    if (!mode_.Empty()) locator_.RecordForce(dynamics_.force());
    system_.space().Rate(x, x + nq, xdot);
    Eigen::Map<Vector>(xdot + nq, d) = dynamics_.acceleration();
  }

  void SampleEnd(GapSample* sample) {
    SampleGaps(system_, stepper_.end(), stepper_.end_field().tail(system_.dof()), &terms_, sample);
  }

  /// Puts the end of the step back on the state manifold and evaluates the field there.
  void FinishStep() {
    if (on_manifold_ && !ProjectState(system_, stepper_.mutable_end())) {
      stepper_.mutable_end()->setConstant(std::nan(""));
    }
    stepper_.Finish();
  }

  void Stop(Outcome outcome, const std::string& reason) {
    std::ostringstream message;
    message.precision(12);
    message << reason << " (stopped at t = " << t_ << " s)";
    trajectory_.status = {outcome, message.str()};
  }

  bool WithinBudget() {
    RunStatistics& work = trajectory_.statistics;
    const long attempts = work.steps + work.rejected_steps;
    if (attempts >= options_.max_steps) {
      Stop(Outcome::kBudgetExceeded,
           "max_steps = " + std::to_string(options_.max_steps) + " integration steps were made");
    } else if (options_.cancelled && options_.cancelled()) {
      Stop(Outcome::kCancelled, "the caller cancelled the run");
    } else if (attempts >= next_clock_reading_) {
      next_clock_reading_ = attempts + kStepsBetweenClockReadings;
      const double now = ThreadSeconds();
      if (deadline_ == 0) deadline_ = now + options_.max_seconds;
      if (now > deadline_) {
        std::ostringstream reason;
        reason << "max_seconds = " << options_.max_seconds << " of processor time were used";
        Stop(Outcome::kBudgetExceeded, reason.str());
      }
    }
    return trajectory_.status.ok();
  }

  /// Flows to the next transition and through it; false when the run is over.
  bool FlowArc() {
    trajectory_.arcs.emplace_back();
    Arc& arc = trajectory_.arcs.back();
    arc.mode = mode_;
    arc.u = dynamics_.u();
    arc.t_begin = arc.t_end = t_;
    arc.x_begin = arc.x_end = x_;
    if (t_ >= duration_) return false;

    rejected_ = false;
    locator_.BeginArc();
    stepper_.Begin(x_);
    SampleGaps(system_, x_, dynamics_.acceleration(), &terms_, &gaps_begin_);
    double h = kFirstStep *
               stepper_.GuessStep(options_.relative_tolerance, options_.absolute_tolerance);
    int trigger = -1;
    const double end = SegmentEnd();
    while (t_ < end && trigger < 0) {
      if (!WithinBudget() || !TakeStep(end, &h, &trigger, &arc)) return false;
    }
    if (trigger >= 0) return PassTransition(trigger);
    return t_ < duration_ && ChangeInput();
  }

  /// When the present input ends.
  double SegmentEnd() const {
    const std::size_t next = segment_ + 1;
    return next < schedule_.grid.size() ? std::min(schedule_.grid[next], duration_) : duration_;
  }

  /// The next input begins: what rests stays in contact unless it would have to pull now.
  bool ChangeInput() {
    dynamics_.SetInput(schedule_.values[++segment_]);
    const ResolvedTransition resolved = ResolveInputChange(&dynamics_, t_, x_, mode_);
    trajectory_.status = resolved.status;
    if (!resolved.status.ok()) return false;
    trajectory_.transitions.push_back(resolved.transition);
    mode_ = resolved.transition.mode_after;
    return true;
  }

  /// One accepted step of at most *h, cut short by an event; false when the run is over.
  bool TakeStep(double segment_end, double* h, int* trigger, Arc* arc) {
    const double limit = options_.max_step > 0 ? options_.max_step : duration_;
    const double rest = segment_end - t_;
    const double length = std::min({*h, limit, rest});
    if (!(length > kSmallestStep * std::max(1.0, t_)) && length < rest) {
      Stop(Outcome::kNonFinite, "the motion leaves the model's domain: no step size is small enough");
      return false;
    }
    locator_.BeginStep();
    const double error =
        stepper_.TryStep(length, options_.relative_tolerance, options_.absolute_tolerance);
    if (!(error <= 1) || !stepper_.end().allFinite()) {
      ++trajectory_.statistics.rejected_steps;
      rejected_ = true;
      const double shrink = kSafety * std::pow(error, -1.0 / 8);
      *h = length * (std::isfinite(error) ? std::max(kSmallestGrowth, shrink) : 0.1);
      return true;
    }
    ++trajectory_.statistics.steps;
    FinishStep();
    if (!stepper_.end().allFinite()) {
      Stop(Outcome::kNonFinite, "the bilateral constraints cannot be met");
      return false;
    }
    SampleEnd(&gaps_end_);
    const LocatedEvent event = locator_.Locate(&stepper_, mode_, gaps_begin_, gaps_end_);
    double end = t_ + length;
    if (event.found) {
      *trigger = event.constraint;
      end = t_ + StepOntoEvent(event, length);
    } else {
      x_ = stepper_.end();
      if (length == rest) end = segment_end;
      const double growth = kSafety * std::pow(std::max(error, 1e-30), -1.0 / 8);
      *h = length * std::clamp(growth, kSmallestGrowth, rejected_ ? 1.0 : kLargestGrowth);
      rejected_ = false;
    }
    if (options_.dense && stepper_.step() > 0) {
      if (!stepper_.extended()) stepper_.Extend();
      arc->dense.Append(t_, stepper_.step(), stepper_.dense(), system_.state_size());
    }
    arc->t_end = t_ = end;
    arc->x_end = x_;
    if (!event.found) {
      stepper_.Advance();
      locator_.EndStep();
      std::swap(gaps_begin_, gaps_end_);
    }
    return true;
  }

  /// Newton's method for the event on the true step: repeats the step with its length as the unknown.
  /// Sets x_ to the state at the event; returns its time after the beginning of the step.
  double StepOntoEvent(const LocatedEvent& event, double length) {
    const int i = event.constraint;
    double s = event.theta * length;
    for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
      locator_.BeginStep();
      stepper_.TryStep(s, options_.relative_tolerance, options_.absolute_tolerance);
      FinishStep();
      x_ = stepper_.end();
      double value, slope;
      if ((mode_ - system_.compliant()).Contains(i)) {
        slope = dynamics_.ForceRate(x_, mode_, i);
        value = dynamics_.force()(i);
      } else {
        SampleEnd(&gaps_end_);
        value = event.touch ? gaps_end_.rate(i) : gaps_end_.gap(i);
        slope = event.touch ? gaps_end_.acceleration(i) : gaps_end_.rate(i);
      }
      const double correction = slope != 0 ? -value / slope : 0;
      if (std::abs(correction) <= kTaylorReach || !std::isfinite(correction)) {
        if (std::isfinite(correction)) {
          x_ += correction * stepper_.end_field();
          s += correction;
        }
        break;
      }
      const double next = std::clamp(s + correction, 0.0, length);
      if (next == s) break;
      s = next;
    }
    return std::max(s, 0.0);
  }

  /// Applies the transition at (t_, x_); false when the run ends there.
  bool PassTransition(int trigger) {
    const ResolvedTransition resolved = ResolveTransition(
        &dynamics_, t_, x_, mode_, trigger,
        {options_.simultaneity_tolerance, options_.speed_tolerance, options_.impact_law});
    Margins& margins = trajectory_.margins;
    margins.approach_speed = std::min(margins.approach_speed, resolved.approach_speed);
    margins.release_rate = std::min(margins.release_rate, resolved.release_rate);
    if (!resolved.status.ok()) {
      if (resolved.status.outcome == Outcome::kGrazing) margins.approach_speed = 0;
      trajectory_.status = resolved.status;
      return false;
    }
    const Transition& transition = resolved.transition;
    margins.cluster_spread = std::max(margins.cluster_spread, transition.spread);
    if (!trajectory_.transitions.empty()) {
      margins.event_interval =
          std::min(margins.event_interval, t_ - trajectory_.transitions.back().t);
    }
    if (static_cast<long>(trajectory_.transitions.size()) >= options_.max_events) {
      Stop(Outcome::kBudgetExceeded, "max_events = " + std::to_string(options_.max_events) +
                                         " transitions were passed");
      return false;
    }
    trajectory_.transitions.push_back(transition);
    mode_ = transition.mode_after;
    x_ = transition.x_plus;
    for (int i : transition.activated) {
      const std::optional<double> accumulation = zeno_.Impact(i, t_);
      if (!accumulation) continue;
      trajectory_.accumulation_time = *accumulation;
      if (options_.complete_zeno) {
        CompleteZeno();
      } else {
        std::ostringstream reason;
        reason.precision(12);
        reason << "impacts of constraint '" << system_.description().constraints[i]
               << "' accumulate at t = " << *accumulation << " s (Zeno)";
        CloseWithEmptyArc();
        Stop(Outcome::kZeno, reason.str());
        return false;
      }
    }
    return true;
  }

  /// Turns the last impact into sticking of all that touch: see SimulateOptions::complete_zeno.
  void CompleteZeno() {
    Transition& last = trajectory_.transitions.back();
    const int d = system_.dof(), nq = system_.num_positions();
    const ContactMode sticking = last.mode_before | last.mode_after | last.activated;
    const ImpactResult impact = Stick(system_, x_.head(nq), last.x_minus.tail(d), sticking);
    last.x_plus.tail(d) = impact.v_plus;
    last.impulse = impact.impulse;
    last.completes_zeno = true;
    const ContactMode pressed = last.mode_after & system_.compliant();
    last.mode_after = SelectContactMode(&dynamics_, last.x_plus, sticking - pressed,
                                        options_.simultaneity_tolerance, pressed);
    last.released = last.mode_before - last.mode_after;
    mode_ = last.mode_after;
    x_ = last.x_plus;
  }

  /// Keeps arcs.size() == transitions.size() + 1 when a run stops right after a transition.
  void CloseWithEmptyArc() {
    Arc arc;
    arc.mode = mode_;
    arc.u = dynamics_.u();
    arc.t_begin = arc.t_end = t_;
    arc.x_begin = arc.x_end = x_;
    trajectory_.arcs.push_back(std::move(arc));
  }

  const MechanicalSystem& system_;
  const InputSchedule& schedule_;
  const SimulateOptions& options_;
  const double duration_;
  const bool on_manifold_;
  ContactDynamics dynamics_;
  EventLocator locator_;
  ZenoDetector zeno_;
  Dop853 stepper_;

  double t_ = 0;
  std::size_t segment_ = 0;  // of the schedule
  bool rejected_ = false;  // the last attempt at a step: the next accepted one does not grow
  Vector x_;
  ContactMode mode_;
  long next_clock_reading_ = kStepsBetweenClockReadings;  // a reading costs as much as a step
  double deadline_ = 0;                                   // set at the first reading
  ConstraintTerms terms_;
  GapSample gaps_begin_, gaps_end_;
  Trajectory trajectory_;
};

}  // namespace

Trajectory Simulate(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u,
                    double duration, const SimulateOptions& options) {
  return Simulate(system, x, InputSchedule::Constant(u), duration, options);
}

Trajectory Simulate(const MechanicalSystem& system, const VectorRef& x,
                    const InputSchedule& schedule, double duration,
                    const SimulateOptions& options) {
  Validate(options);
  Validate(system, schedule);
  if (!(duration >= 0) || !std::isfinite(duration)) {
    std::ostringstream message;
    message << "duration is " << duration << " s: it must be finite and not negative";
    throw std::invalid_argument(message.str());
  }
  const ContactMode mode = InitialMode(system, x, schedule.values.front(), options);
  return Run(system, schedule, duration, options).Go(x, mode);
}

}  // namespace contact_flow
