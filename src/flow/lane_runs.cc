// SPDX-License-Identifier: BSD-3-Clause
#include "lane_runs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "contact_flow/budget.h"
#include "src/clocks.h"
#include "step_constants.h"
#include "thrown_down.h"

namespace contact_flow {
namespace {

/// Rounds between readings of the clock.
constexpr int kRounds = 64;
/// A stiffness so near to the limit counts as beyond it: it is summed in another order here.
constexpr double kNearlyStable = 0.99;

}  // namespace

LaneRuns::LaneRuns(const BatchRequest& request, std::unique_ptr<LaneStepper> stepper)
    : request_(request),
      system_(request.system),
      options_(request.options),
      stepper_(std::move(stepper)),
      arrays_(stepper_->arrays()),
      width_(arrays_.width),
      d_(system_.dof()),
      n_(system_.num_constraints()),
      dynamics_(system_, request.Input(0)),
      starter_(2 * d_,
               [this](const double* x, double* xdot) {
                 dynamics_.Evaluate(Eigen::Map<const Vector>(x, 2 * d_), mode_);
                 std::copy(x + d_, x + 2 * d_, xdot);
                 Eigen::Map<Vector>(xdot + d_, d_) = dynamics_.acceleration();
               }),
      guards_(system_),
      locator_(&dynamics_, options_),
      view_(stepper_.get(), 2 * d_),
      touchdown_(system_),
      arc_error_(system_.space()),
      x_end_(2 * d_),
      force_(n_) {
  for (int k = 0; k < width_; ++k) lanes_.emplace_back(system_);
  end_.gap.resize(n_);
  end_.rate.resize(n_);
  end_.acceleration.resize(n_);
}

void LaneRuns::Run(std::atomic<std::size_t>* next, std::vector<BatchRun>* results) {
  next_ = next;
  results_ = results;
  for (int k = 0; k < width_; ++k) Fill(k);
  const auto busy = [&] {
    return std::any_of(lanes_.begin(), lanes_.end(), [](const Lane& lane) { return lane.busy; });
  };
  for (int round = 0; busy(); ++round) {
    bool stop = options_.cancelled && options_.cancelled();
    try {
      AskBudget();
    } catch (const BudgetExceeded&) {
      stop = true;  // Simulate says so, of each run
    }
    const double now = round % kRounds == 0 ? ThreadSeconds() : 0;
    stepper_->TryStep(options_.relative_tolerance, options_.absolute_tolerance);
    stepper_->Finish();
    view_.ForgetExtension();
    for (int k = 0; k < width_; ++k) {
      arrays_.accept[k] = 0;
      if (!lane(k).busy) continue;
      if (round % kRounds == 0 && lane(k).began == 0) lane(k).began = now;
      const bool late = now > 0 && now - lane(k).began > options_.max_seconds;
      if (stop || late || !Settle(k)) End(k);
    }
    stepper_->Advance();
    for (int k = 0; k < width_; ++k) {
      if (arrays_.accept[k] != 0 && !Accept(k)) End(k);
    }
  }
}

/// A run that does not go on in its lane gives way to the next.
void LaneRuns::End(int k) {
  arrays_.accept[k] = 0;
  if (lane(k).busy) (*results_)[lane(k).run] = request_.RunAlone(lane(k).run);
  Fill(k);
}

/// The next start that goes in a lane.
void LaneRuns::Fill(int k) {
  lane(k).busy = false;
  arrays_.h[k] = 0;
  for (;;) {
    const std::size_t run = next_->fetch_add(1);
    if (run >= results_->size()) return;
    lane(k).run = run;
    if (Start(k)) return;
    (*results_)[run] = request_.RunAlone(run);
  }
}

void LaneRuns::Write(const double* from, int rows, double* to, int k) const {
  for (int i = 0; i < rows; ++i) to[i * width_ + k] = from[i];
}

/// Of what is evaluated by one state at a time from now on.
void LaneRuns::Use(const Lane& lane) {
  mode_ = lane.mode;
  if (lane.u.size() > 0) dynamics_.SetInput(lane.u);
}

/// False where the run is to be made alone: so do all that follow.
bool LaneRuns::Start(int k) {
  Lane& run = lane(k);
  run.x = request_.states.col(static_cast<Eigen::Index>(run.run));
  run.u = request_.Input(run.run);
  if (!run.x.allFinite() || !run.u.allFinite() || !(request_.duration > 0)) return false;
  system_.Constraints(run.x.head(d_), run.x.tail(d_), &terms_);
  run.mode = ContactMode();
  if (!(terms_.gap.array() > options_.gap_tolerance).all()) {
    try {
      run.mode = InitialMode(system_, run.x, run.u, options_);
    } catch (const std::invalid_argument&) {
      return false;
    }
    const Vector rate = terms_.jacobian * run.x.tail(d_);
    for (int i : run.mode - system_.compliant()) {  // Flow::BeginAtRest
      if (std::abs(rate(i)) > options_.absolute_tolerance) return false;
    }
  }
  static_cast<Counts&>(run) = Counts();
  run.result = BatchRun();
  run.result.first_mode = run.mode;
  run.margins = GuardMargins();
  run.force_minima.emplace(n_);
  run.stopped.emplace(options_);
  run.run_margins = Margins();
  run.start_error.Reset();
  run.zeno.emplace(n_, options_.zeno_interval);
  run.busy = BeginArc(k) && Propose(k);
  return run.busy;
}

const ModeMaps& LaneRuns::MapsOf(const Lane& lane) {
  for (const ModeMaps& maps : maps_) {
    if (maps.mode == lane.mode) return maps;
  }
  maps_.push_back(MapsOfMode(system_, lane.x, lane.u, lane.mode));
  return maps_.back();
}

bool LaneRuns::BeginArc(int k) {
  Lane& run = lane(k);
  const ModeMaps& maps = MapsOf(run);
  if (!maps.regular) return false;
  run.maps = &maps;
  stepper_->SetMaps(k, maps.inverse.data(), maps.force_map.data());
  Use(run);
  const long before = dynamics_.evaluations();
  starter_.Begin(run.x);
  force_ = dynamics_.force().head(n_);
  SampleGaps(system_, run.x, dynamics_.acceleration(), &terms_, &run.begin);
  run.margins.low = locator_.Low(run.begin);
  run.stopped->Follow(run.begin, &run.margins.gap);
  Write(run.x.data(), 2 * d_, arrays_.x, k);
  if (MayBeThrownDown(run.begin, run.mode, options_) || Implies(run) || Drifts(k)) return false;
  run.h = kFirstStep * starter_.GuessStep(options_.relative_tolerance, options_.absolute_tolerance);
  run.evaluations += dynamics_.evaluations() - before;
  for (int i = 0; i < 2 * d_; ++i) arrays_.tally[i * width_ + k] = 0;
  Write(starter_.begin_field().data(), 2 * d_, arrays_.stages, k);
  Write(force_.data(), n_, arrays_.forces, k);
  Write(run.u.data(), static_cast<int>(run.u.size()), arrays_.u, k);
  return true;
}

/// Whether the mode holds touching contacts without forces of their own.
bool LaneRuns::Implies(const Lane& run) {
  ConstraintSet near;
  for (int i = 0; i < n_ && !run.mode.Empty(); ++i) {
    if (run.mode.Contains(i)) continue;
    const bool touches = std::abs(run.begin.gap(i)) <= kImpliedReach * options_.absolute_tolerance;
    if (touches && std::abs(run.begin.rate(i)) <= options_.speed_tolerance) near.Insert(i);
  }
  if (near.Empty()) return false;
  for (const NearContacts& known : near_) {
    if (known.mode == run.mode && known.near == near) return known.implied;
  }
  ImpliedGaps implied;
  implied.Find(system_, run.x, run.u, run.mode, near, run.begin.gap);
  near_.push_back({run.mode, near, !implied.Empty()});
  return near_.back().implied;
}

bool LaneRuns::Propose(int k) {
  Lane& run = lane(k);
  if (Penetrates(run)) return false;
  run.next_quick_end = run.quick_end;
  run.next_quick_step = run.quick_step;
  run.try_h = run.h;
  run.rejected = false;
  return Attempt(k);
}

bool LaneRuns::Attempt(int k) {
  Lane& run = lane(k);
  run.onto = run.redo = false;
  if (run.attempts >= options_.max_steps) return false;
  double limit =
      options_.max_step > 0 ? options_.max_step : std::numeric_limits<double>::infinity();
  if (run.t < run.next_quick_end) limit = std::min(limit, run.next_quick_step);
  run.rest = request_.duration - run.t;
  run.length = std::min({run.try_h, limit, run.rest});
  if (!(run.length > kSmallestStep * std::max(1.0, run.t)) && run.length < run.rest) return false;
  ++run.attempts;
  arrays_.h[k] = run.length;
  return true;
}

bool LaneRuns::Repeat(int k, double h) {
  lane(k).rejected = true;
  lane(k).try_h = h;
  return Attempt(k);
}

void LaneRuns::LoadGaps(int k, GapSample* sample) {
  for (int i = 0; i < n_; ++i) {
    sample->gap(i) = At(arrays_.gap, i, k);
    sample->rate(i) = At(arrays_.rate, i, k);
    sample->acceleration(i) = At(arrays_.acceleration, i, k);
  }
}

bool LaneRuns::Settle(int k) {
  Lane& run = lane(k);
  if (run.onto) return SettleOnto(k);
  run.evaluations += 11;
  const double error = arrays_.error[k];
  if (!std::isfinite(arrays_.sum[k])) return false;
  if (!(error <= 1)) {
    const double shrink = kSafety * std::pow(error, starter_.exponent());
    return Repeat(k, run.length * std::max(kSmallestGrowth, shrink));
  }
  ++run.evaluations;
  LoadGaps(k, &end_);
  const bool free = error < kFreeError;
  run.next_margins = run.margins;
  LocatedEvent event;
  if (!IsClear(k, free, &event.growth)) event = Locate(k, free);
  if (!event.found && event.theta < 1) {
    run.next_quick_end = run.t + run.length;
    run.next_quick_step = run.length * std::clamp(event.theta, kLeastPart, kLargestPart);
    return Repeat(k, run.next_quick_step);
  }
  if (!event.found) {
    run.event.growth = event.growth;
    NoteForces(k);
    arrays_.accept[k] = 1;
    return true;
  }
  run.onto = true;
  run.event = event;
  run.iteration = 0;
  run.nearest = run.s = event.theta * run.length;
  run.least = std::numeric_limits<double>::infinity();
  arrays_.h[k] = run.s;
  return true;
}

void LaneRuns::CountStep(int k) {
  Lane& run = lane(k);
  ++run.steps;
  if (run.new_arc) run.arc_begin = run.t;
  run.new_arc = false;
}

/// After the step was taken by Advance.
bool LaneRuns::Accept(int k) {
  Lane& run = lane(k);
  CountStep(k);
  const double growth = kSafety * view_.Growth(arrays_.error[k]);
  const double largest = std::min(run.rejected ? 1.0 : kLargestGrowth, run.event.growth);
  run.h = run.length * std::min(std::max(growth, kSmallestGrowth), largest);
  run.t = run.length == run.rest ? request_.duration : run.t + run.length;
  run.margins = run.next_margins;
  run.quick_end = run.next_quick_end;
  run.quick_step = run.next_quick_step;
  LoadGaps(k, &run.begin);
  run.stopped->Follow(run.begin, &run.margins.gap);
  if (Drifts(k) || IsStiff(k)) return false;
  if (run.t < request_.duration) return Propose(k);
  for (int i = 0; i < 2 * d_; ++i) run.x(i) = At(arrays_.x, i, k);
  Finish(k);
  return false;
}

/// Whether the implicit method might take over: sooner than it would, never later.
bool LaneRuns::IsStiff(int k) {
  Lane& run = lane(k);
  if (options_.method != IntegrationMethod::kAutomatic) return false;
  if (arrays_.stiffness[k] > kNearlyStable * Dop853::kStable) {
    ++run.stiff_steps;
    run.soft_steps = 0;
  } else if (++run.soft_steps >= kOthers) {
    run.stiff_steps = 0;
  }
  return run.stiff_steps >= kStiffSteps;
}

void LaneRuns::Finish(int k) {
  Lane& run = lane(k);
  BatchRun& result = run.result;
  result.t_end = run.t;
  result.final_state = run.x;
  result.error.resize(2 * d_);
  for (int i = 0; i < 2 * d_; ++i) {
    result.error(i) = run.new_arc ? 0 : At(arrays_.tally, i, k);
  }
  result.margins = run.run_margins;
  result.margins.gap = run.margins.gap;
  result.margins.force = run.margins.force;
  result.statistics.field_evaluations = run.evaluations;
  result.statistics.steps = run.steps;
  result.statistics.rejected_steps = run.attempts - run.steps;
  (*results_)[run.run] = std::move(result);
  run.busy = false;
}

}  // namespace contact_flow
