// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/flow.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "contact_flow/budget.h"
#include "contact_flow/fixed_size.h"
#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/flow/transition.h"
#include "src/clocks.h"
#include "step_constants.h"

namespace contact_flow {
namespace {

constexpr double kImpliedOvershoot = 2;    // steps are shorter than to move further
constexpr int kStepsBetweenLooks = 8;      // at the coarse clock: a hundredth of a step
constexpr double kBetweenReadings = 2e-3;  // of the thread's clock, each as dear as a step [s]

}  // namespace

Flow::Flow(const MechanicalSystem& system, double t, const VectorRef& x, ContactMode mode,
           const VectorRef& u, const SimulateOptions& options)
    : system_(system),
      options_(options),
      on_manifold_(HasStateManifold(system)),
      dynamics_(system, u),
      guards_(system),
      locator_(&dynamics_, options),
      corners_(system),
      zeno_(system.num_constraints(), options.zeno_interval),
      explicit_(system.state_size(), [this](const double* y, double* ydot) { Field(y, ydot); }),
      stepper_(&explicit_),
      t_(t),
      x_(x),
      mode_(mode),
      end_(t),
      x_end_(x),
      arc_error_(system.space()),
      start_error_(system.space()),
      next_clock_reading_(CoarseSeconds() + kBetweenReadings) {
  if (on_manifold_) ProjectState(system_, &x_);
  if (!mode.Empty()) BeginAtRest();
  if (options.method == IntegrationMethod::kImplicit) MakeImplicit();
  if (options.method == IntegrationMethod::kAutomatic) explicit_.WatchStiffness();
}

void Flow::Field(const double* x, double* xdot) {
  const int d = system_.dof(), nq = system_.num_positions();
  dynamics_.Evaluate(Eigen::Map<const Vector>(x, nq + d), mode_);
  if (!mode_.Empty()) locator_.RecordForce(dynamics_.force(), mode_);
  const double *v = x + nq, *acceleration = dynamics_.acceleration().data();
  const bool flat = system_.space().IsFlat();
  if (!flat) system_.space().Rate(x, v, xdot);
  WithFixedSize(d, [&](auto few) {
    for (int i = 0; flat && i < few; ++i) xdot[i] = v[i];
    for (int i = 0; i < few; ++i) xdot[nq + i] = acceleration[i];
  });
}

void Flow::SampleEnd(GapSample* sample) {
  SampleGaps(system_, stepper_->end(), stepper_->end_field().tail(system_.dof()), &terms_, sample);
}

/// Puts the end of the step back on the state manifold and evaluates the field there.
void Flow::FinishStep() {
  Vector& end = *stepper_->mutable_end();
  const bool held = drifts_ && ProjectContacts(system_, mode_, &end);
  if (!held && on_manifold_) {
    const double size = end.head(system_.num_positions()).cwiseAbs().maxCoeff();
    const double leap = kLeap * (options_.absolute_tolerance + options_.relative_tolerance * size);
    if (!ProjectState(system_, &end, leap)) end.setConstant(std::nan(""));
  }
  stepper_->Finish();
}

void Flow::Stop(Outcome outcome, const std::string& reason) {
  std::ostringstream message;
  message.precision(12);
  message << reason << " (stopped at t = " << t_ << " s)";
  status_ = {outcome, message.str()};
}

/// What a run that has used up its steps might do about it.
const char* Flow::StiffHint() const {
  const bool may_switch = options_.method == IntegrationMethod::kExplicit;
  return may_switch ? "; stiff forces, and feet that creep, take less with method: automatic" : "";
}

bool Flow::ClockIsDue() const {
  if (next_clock_reading_ == kAtOnce) return true;
  return attempts_ % kStepsBetweenLooks == 0 && CoarseSeconds() >= next_clock_reading_;
}

bool Flow::WithinBudget() {
  AskBudget();
  if (attempts_ >= options_.max_steps) {
    Stop(Outcome::kBudgetExceeded, "max_steps = " + std::to_string(options_.max_steps) +
                                       " integration steps were made" + StiffHint());
  } else if (options_.cancelled && options_.cancelled()) {
    Stop(Outcome::kCancelled, "the caller cancelled the run");
  } else if (ClockIsDue()) {
    next_clock_reading_ = CoarseSeconds() + kBetweenReadings;
    if (ReadClock() > deadline_) {
      std::ostringstream reason;
      reason << "max_seconds = " << options_.max_seconds << " of processor time were used"
             << StiffHint();
      Stop(Outcome::kBudgetExceeded, reason.str());
    }
  }
  return status_.ok();
}

void Flow::BeginArc() {
  locator_.BeginArc();
  stepper_->Begin(x_);
  SampleGaps(system_, x_, dynamics_.acceleration(), &terms_, &gaps_begin_);
  guard_margins_.low = LowAtBegin();
  FollowStopped();
  FindImplied();
  thrown_ = ThrownDown();
  drifts_ = Drifts(x_, gaps_begin_);
  WarnOfSharedForces();
  if (system_.HasFriction()) {
    dynamics_.Evaluate(x_, mode_);
    regular_slip_ = dynamics_.slip_regularity();
    margins_.painleve = std::min(margins_.painleve, regular_slip_);
    MeetTurns();
  }
  h_ = kFirstStep * stepper_->GuessStep(options_.relative_tolerance, options_.absolute_tolerance);
  arc_begun_ = true;
}

bool Flow::Propose(double end) {
  if (!status_.ok()) return false;
  if (!arc_begun_) BeginArc();
  if (Penetrates()) return false;
  trigger_ = -1;
  jam_.reset();
  singular_slip_ = false;
  apart_ = ConstraintSet();
  quick_next_ = quick_;
  stepper_->Restart();
  double h = h_;
  bool rejected = false;
  bool accepted = false;
  while (!accepted) {
    if (!WithinBudget()) return false;
    locator_.RestoreMargins(guard_margins_);
    accepted = Attempt(end, &h, &rejected);
    if (!status_.ok()) return false;
    if (accepted && !implied_.Empty() && trigger_ >= 0) SampleEnd(&gaps_end_);
    if (accepted && ImpliedThatMoved(kImpliedOvershoot) >= 0) {
      accepted = false;
      rejected = true;
      trigger_ = -1;
      h = 0.5 * (end_ - t_);
    }
  }
  return true;
}

/// Tries one step of at most *h, cut short by an event; true when its error is small enough.
bool Flow::Attempt(double end, double* h, bool* rejected) {
  double limit =
      options_.max_step > 0 ? options_.max_step : std::numeric_limits<double>::infinity();
  if (t_ < quick_next_.end) limit = std::min(limit, quick_next_.step);
  const double rest = end - t_;
  limit = std::min(limit, SlipInSpaceLimit());
  const double knot = TimeToKnot();
  double length = std::min({*h, limit, rest, knot});
  if (!(length > kSmallestStep * std::max(1.0, t_)) && length < rest) {
    if (EndSlipAtNode()) return true;
    StopWithoutSteps();
    return false;
  }
  ++attempts_;
  locator_.BeginStep();
  double error =
      stepper_->TryStep(length, options_.relative_tolerance, options_.absolute_tolerance);
  too_quick_ = -1;
  const bool cornered = corners_.HasCorners() && stepper_->end().allFinite();
  if (cornered) error = StepOntoCorner(error, &length);
  if (!(error <= 1) || !stepper_->end().allFinite()) {
    *rejected = true;
    const double shrink = kSafety * std::pow(error, stepper_->exponent());
    *h = length * (std::isfinite(error) ? std::max(kSmallestGrowth, shrink) : 0.1);
    return false;
  }
  if (!cornered) FinishStep();
  if (!stepper_->end().allFinite()) {
    Stop(Outcome::kNonFinite, "the bilateral constraints cannot be met");
    return false;
  }
  regular_end_ = dynamics_.slip_regularity();
  if (CrossesSingularSlip(length) || LosesLoop()) {
    *rejected = true;
    *h = 0.5 * length;
    return false;
  }
  SampleEnd(&gaps_end_);
  misfit_ = HeldMisfit();
  const bool apart = misfit_ > kImpliedOvershoot && length > kShortest * std::max(1.0, t_);
  if (apart || OutgrowsTurn()) {
    *rejected = true;
    *h = (apart ? 0.5 : kPhantomPart) * length;
    return false;
  }
  LocatedEvent event = locator_.Locate(stepper_, mode_, gaps_begin_, gaps_end_, error < kFreeError);
  if (thrown_ >= 0) {
    const double fall = -gaps_begin_.gap(thrown_) / gaps_begin_.rate(thrown_);
    event = {true, std::clamp(fall / length, 0.0, 1.0), thrown_};
  }
  if (!event.found && event.theta < 1) {  // the step is too long for a guard
    too_quick_ = event.constraint;
    *rejected = true;
    *h = length * std::clamp(event.theta, kLeastPart, kLargestPart);
    quick_next_ = {t_ + length, *h};
    return false;
  }
  if (event.found) {
    const std::optional<double> reached = StepOntoEvent(event, length);
    if (!reached) {  // the extension told of a zero that the motion does not have
      too_quick_ = event.constraint;
      *rejected = true;
      *h = kPhantomPart * length;
      return false;
    }
    trigger_ = event.constraint;
    end_ = t_ + *reached;
  } else {
    x_end_ = stepper_->end();
    end_ = length == rest ? end : t_ + length;
    trigger_ = StoppedInSpace();
    singular_slip_ = trigger_ < 0 && !(regular_slip_ < 0) && regular_end_ < 0;
    if (singular_slip_) trigger_ = *(mode_ - mode_.Sticking()).begin();
    if (trigger_ < 0) trigger_ = HeldApart();
    const double growth = kSafety * stepper_->Growth(error);
    const double largest = std::min(*rejected ? 1.0 : kLargestGrowth, event.growth);
    h_next_ = length * std::min(std::max(growth, kSmallestGrowth), largest);
    if (length == knot && !*rejected) h_next_ = std::max(h_next_, *h);
    if (cornered) h_next_ = StepBehindCorner(h_next_);
  }
  return true;
}

const double* Flow::ProposedDense() {
  if (!stepper_->extended()) stepper_->Extend();
  return stepper_->dense();
}

void Flow::TallyStep() {
  if (new_arc_) {
    arc_error_.Reset();
    arc_begin_ = t_;
  }
  new_arc_ = false;
  implicit_steps_ += ProposesImplicit();
  arc_error_.AddStep(*stepper_);
}

bool Flow::Accept() {
  if (!jam_) {
    ++steps_;
    TallyStep();
  }
  t_ = end_;
  x_ = x_end_;
  guard_margins_ = locator_.margins();
  if (!jam_) NoteForces();
  if (trigger_ < 0) trigger_ = ImpliedThatMoved(1);
  if (!jam_) ForgetRisen();
  quick_ = quick_next_;
  if (trigger_ >= 0) {
    arc_begun_ = false;
    const bool passed = PassTransition();
    if (passed) NoteGrazes(true);
    new_arc_ = passed || !status_.ok();  // now: its rules look back at the arc that has ended
    return passed;
  }
  h_ = h_next_;
  stepper_->Advance();
  locator_.EndStep();
  regular_slip_ = regular_end_;
  margins_.painleve = std::min(margins_.painleve, regular_slip_);
  std::swap(gaps_begin_, gaps_end_);
  FollowStopped();
  drifts_ = Drifts(x_, gaps_begin_);
  if (options_.method != IntegrationMethod::kImplicit) ConsiderMethod();
  return false;
}

bool Flow::Cut(double t) {
  ++steps_;
  ++attempts_;
  locator_.RestoreMargins(guard_margins_);
  locator_.BeginStep();
  const double error =
      stepper_->TryStep(t - t_, options_.relative_tolerance, options_.absolute_tolerance);
  FinishStep();
  Vector x = stepper_->end();
  const bool solved = x.allFinite();
  if (!solved) {  // an implicit step that was not solved: where the whole one passes
    stepper_->TryStep(end_ - t_, options_.relative_tolerance, options_.absolute_tolerance);
    FinishStep();
    EvaluateDenseStep(ProposedDense(), system_.state_size(), (t - t_) / (end_ - t_), x.data());
  }
  if (!x.allFinite()) {
    Stop(Outcome::kNonFinite, "the motion leaves the model's domain");
    return false;
  }
  TallyStep();
  t_ = t;
  x_ = x;
  arc_begun_ = false;
  if (solved) NoteCutStep(error);
  return true;
}

bool Flow::ChangeInput(const VectorRef& u) {
  const bool stepped = !arc_begun_;
  dynamics_.SetInput(u);
  arc_begun_ = false;
  ResolvedTransition resolved = system_.HasFriction()
                                    ? ResolveFrictionalInput(&dynamics_, t_, x_, mode_, Rules())
                                    : ResolveInputChange(&dynamics_, t_, x_, mode_, Rules());
  status_ = resolved.status;
  if (!status_.ok()) return false;
  for (const Warning& warning : resolved.warnings) Warn(warning.code, warning.message);
  transition_ = std::move(resolved.transition);
  x_ = transition_.x_plus;
  last_transition_ = t_;
  NoteGrazes(stepped);
  if (!new_arc_) start_error_.Continue(t_ - arc_begin_, arc_error_);
  new_arc_ = true;
  ++transitions_;
  mode_ = transition_.mode_after;
  force_minima_.BeginArc(guards_.OfForces(mode_, {}));
  return true;
}

}  // namespace contact_flow
