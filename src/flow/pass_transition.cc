// SPDX-License-Identifier: BSD-3-Clause
// What a Flow does at its events.
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "contact_flow/flow/flow.h"
#include "dead_end.h"
#include "src/clocks.h"
#include "src/dynamics/implied_contacts.h"
#include "src/dynamics/known_pads.h"
#include "step_constants.h"

namespace contact_flow {
namespace {

/// Rounding of a rate Da_i v, relative to its terms.
constexpr double kNoSpeed = 1e-12;

}  // namespace

TransitionRules Flow::Rules() const {
  ErrorTally error = start_error_;  // of the present arc and the one before
  if (!new_arc_) error.Continue(t_ - arc_begin_, arc_error_);
  return {options_.simultaneity_tolerance,
          options_.speed_tolerance,
          options_.impact_law,
          options_.gap_tolerance,
          options_.absolute_tolerance,
          stalls_ >= kStallsToInsist,
          options_.relative_tolerance,
          options_.absolute_tolerance,
          error.error(),
          implied_.constraints(),
          &closed_};
}

void Flow::Warn(Outcome code, const std::string& message) {
  if (num_warnings_++ < Trajectory::kMaxWarnings) warnings_.push_back({code, t_, message});
}

void Flow::StopWithoutSteps() {
  const auto& names = system_.description().constraints;
  Stop(Outcome::kNonFinite,
       too_quick_ >= 0
           ? "constraint '" + names[guards_.ConstraintOf(too_quick_)] +
                 "' changes too quickly: no step size resolves it"
           : "the motion leaves the model's domain: no step size is small enough" +
                 SingularMass(system_, x_, u(), mode_) + LostLoop(system_, x_, loop_size_));
}

void Flow::WarnOfSharedForces() {
  const auto tell = [this](ConstraintSet contacts, const char* what) {
    std::ostringstream message;
    message.precision(12);
    message << "at t = " << t_ << " s contacts "
            << contacts.ToString(system_.description().constraints)
            << " share forces that are not unique, their rows being dependent; " << what;
    Warn(Outcome::kIndeterminateForces, message.str());
  };
  const ConstraintSet shared = dynamics_.shared() - dynamics_.springs();
  if (!(shared - shared_).Empty()) {
    shared_ = shared_ | shared;
    const ConstraintSet told = SharedBesidePads(system_, x_, mode_, shared);
    if (!told.Empty()) {
      tell(told,
           "the motion is. Those told of are the admissible ones with the smallest sum of squares");
    }
  }
  if (!(dynamics_.springs() - springs_).Empty()) {
    springs_ = springs_ | dynamics_.springs();
    tell(dynamics_.springs(), "they decide the motion, and are those of equal springs");
  }
}

/// Counts events that come again without time between them; false when there are too many.
bool Flow::GoesOn() {
  const bool again = last_transition_ && trigger_ == last_trigger_ &&
                     t_ - *last_transition_ <=
                         std::min(kLongestStall, std::max(kNoTime * std::abs(t_),
                                                          kNoTimeApart * transition_.tolerance));
  stalls_ = again ? stalls_ + 1 : 0;
  const bool changed = transition_.mode_before != transition_.mode_after ||
                       !transition_.activated.Empty() || transition_.changes_input;
  const bool soon =
      last_transition_ && t_ - *last_transition_ <= kLongestStall * std::max(1.0, std::abs(t_));
  idle_ = soon && !changed ? idle_ + 1 : 0;
  last_trigger_ = trigger_;
  if (std::max(stalls_, idle_) <= LongestCrowd(system_.num_constraints())) return true;
  if (system_.HasFriction() && !CrowdsAgain()) return true;  // SettleCrowd ends them first
  const std::string& name = system_.description().constraints[guards_.ConstraintOf(trigger_)];
  Stop(system_.HasFriction() ? Outcome::kChatter : Outcome::kBudgetExceeded,
       "events of constraint '" + name + "' follow each other without time between them");
  return false;
}

/// Processor time of this thread [s], from whose first reading on the deadline counts.
double Flow::ReadClock() {
  const double now = ThreadSeconds();
  if (deadline_ == 0) deadline_ = now + options_.max_seconds;
  return now;
}

/// Applies the transition at (t_, x_); false when it cannot be, and the run ends before it.
bool Flow::PassTransition() {
  if (!GoesOn()) return false;
  // Words of many contacts take longer than steps do.
  if (system_.HasFriction()) {
    ReadClock();
    next_clock_reading_ = kAtOnce;
    NoteSlipRegularity();
  }
  ResolvedTransition resolved = ResolveAtEvent();
  SettleCrowd(&resolved);
  margins_.approach_speed = std::min(margins_.approach_speed, resolved.approach_speed);
  margins_.release_rate = std::min(margins_.release_rate, resolved.release_rate);
  if (!resolved.status.ok()) {
    status_ = resolved.status;
    return false;
  }
  if (!TakesOtherWord(resolved)) return false;
  margins_.cluster_spread = std::max(margins_.cluster_spread, resolved.transition.spread);
  if (last_transition_) {
    margins_.event_interval = std::min(margins_.event_interval, t_ - *last_transition_);
  }
  if (transitions_ >= options_.max_events) {
    Stop(Outcome::kBudgetExceeded,
         "max_events = " + std::to_string(options_.max_events) + " transitions were passed");
    return false;
  }
  for (const Warning& warning : resolved.warnings) Warn(warning.code, warning.message);
  transition_ = std::move(resolved.transition);
  NoteHeldDown();
  held_down_ = t_ < held_until_ ? held_down_ & transition_.mode_after : ConstraintSet();
  if (held_down_.Empty()) held_until_ = t_;
  held_down_ = held_down_ | resolved.held_down;
  held_until_ = std::max(held_until_, t_ + resolved.held_interval);
  last_transition_ = t_;
  ++transitions_;
  mode_ = transition_.mode_after;
  x_ = transition_.x_plus;
  force_minima_.BeginArc(guards_.OfForces(mode_, {}));
  TallyTransition();
  const std::optional<double> accumulation = Accumulation(resolved);
  if (!accumulation) return true;
  accumulation_time_ = *accumulation;
  const ConstraintSet rest = EndOfBounces();
  if (rest.Empty()) {  // the last impact has lifted all of them for longer: they do not accumulate
    accumulation_time_ = std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  if (CompleteZeno(rest)) return true;
  std::ostringstream reason;
  reason.precision(12);
  const std::string& name = system_.description().constraints[guards_.ConstraintOf(trigger_)];
  reason << "impacts of constraint '" << name << "' accumulate at t = " << *accumulation
         << " s (Zeno)";
  Stop(Outcome::kZeno, reason.str());
  return true;
}

/// A contact that an impact would have thrown up, too slowly to be resolved, takes part in the next
/// one as if it had never left: had it been above its surface, however little, they would have come
/// one after the other, with another outcome.
void Flow::NoteHeldDown() {
  if (held_down_.Empty() || t_ >= held_until_ || transition_.activated.Empty()) return;
  ConstraintSet hit;
  for (int i : held_down_) {
    if (transition_.impulse(i) > 0) hit.Insert(i);
  }
  if (hit.Empty()) return;
  std::ostringstream reason;
  reason.precision(12);
  reason << "at t = " << t_ << " s contacts " << hit.ToString(system_.description().constraints)
         << ", which the last impact would have thrown up until t = " << held_until_
         << " s, too slowly to be resolved, are hit together with "
         << transition_.activated.ToString(system_.description().constraints)
         << ": one after the other may have another outcome, it is not continuous here";
  transition_.obstacle = {Outcome::kDiscontinuous, reason.str()};
  Warn(Outcome::kDiscontinuous, reason.str());
}

/// What the errors of the last arc become by its event. Those of longer ago are those of all events
/// to come alike, or have been forgotten.
void Flow::TallyTransition() {
  start_error_ = arc_error_;
  const ConstraintSet closed = transition_.mode_before | transition_.activated;
  const bool keeps = system_.HasFriction() && !closed.Empty();
  if (!keeps && transition_.activated.Empty()) return;
  const int d = system_.dof();
  const Vector v_minus = transition_.x_minus.tail(d);
  system_.Constraints(transition_.x_minus.head(system_.num_positions()), v_minus, &terms_);
  if (keeps) closed_.Note(t_, closed - system_.compliant(), terms_.gap);
  if (transition_.activated.Empty()) return;
  Matrix rows(transition_.activated.Size(), d);
  Eigen::Index row = 0;
  for (int i : transition_.activated) rows.row(row++) = terms_.jacobian.row(i);
  start_error_.AddImpact(rows, rows * v_minus, transition_.x_plus.tail(d) - v_minus);
  const ConstraintSet open = ConstraintSet::All(system_.num_constraints()) - mode_ - closed -
                             system_.compliant() - implied_.constraints();
  stopped_gaps_.Impact(open, terms_, v_minus, x_.tail(d));
  for (int i : open) {
    const double gap = terms_.gap(i);
    if (gap > options_.absolute_tolerance) continue;
    NoteUnresolvedReturn(i, gap, terms_.jacobian.row(i).dot(x_.tail(d)));
  }
}

/// A contact so near to touching that no guard tells, which an impact elsewhere turns back, and
/// which opens again by itself: a derivative would depend on whether it touches.
void Flow::NoteUnresolvedReturn(int i, double gap, double rate) {
  const int d = system_.dof(), nq = system_.num_positions();
  dynamics_.Evaluate(x_, mode_);
  system_.Constraints(x_.head(nq), x_.tail(d), &terms_);
  const auto row = terms_.jacobian.row(i);
  const double opening = row.dot(dynamics_.acceleration()) + terms_.bias(i);
  const bool turned = rate < -kNoSpeed * row.cwiseAbs().dot(x_.tail(d).cwiseAbs());
  const bool returns = gap - rate * rate / (2 * opening) < -options_.absolute_tolerance;
  if (!turned || !(opening > 0) || returns) return;
  std::ostringstream reason;
  reason << "at t = " << t_ << " s constraint '" << system_.description().constraints[i] << "', "
         << gap << " m from touching, is turned towards it at " << -rate
         << " m/s by an impact elsewhere and opens again: grazing, as far as it is known";
  transition_.obstacle = {Outcome::kGrazing, reason.str()};
}

/// Contacts that rest, or stick, as the run begins have no speed: what the start leaves of it,
/// below the tolerance, is taken away, if integration would not leave as much. Slips in space that
/// begin with the run get their directions, as at a change of the input.
void Flow::BeginAtRest() {
  SampleGaps(system_, x_, Vector::Zero(system_.dof()), &terms_, &gaps_begin_);
  const ContactMode rigid = mode_.Without(system_.compliant());
  ContactMode resting = mode_;
  double fastest = 0;
  for (int i : rigid) {
    fastest = std::max(fastest, std::abs(gaps_begin_.rate(i)));
    if (!system_.HasFriction()) continue;
    const Friction& friction = system_.friction()[i];
    const double slip = gaps_begin_.rate.segment(friction.row, friction.dimension).norm();
    const bool in_space = friction.dimension == 2 && friction.coefficient > 0;
    if (mode_.LetterOf(i) == Letter::kStick) {
      fastest = std::max(fastest, slip);
    } else if (in_space && slip <= options_.speed_tolerance) {
      resting.Set(i, Letter::kStick);
    }
  }
  if (fastest > options_.absolute_tolerance) MakeRest(system_, rigid, {}, &x_);
  if (resting == mode_) return;
  const ResolvedTransition begun = ResolveFrictionalInput(&dynamics_, t_, x_, resting, Rules());
  status_ = begun.status;
  if (!status_.ok()) return;
  x_ = begun.transition.x_plus;
  mode_ = begun.transition.mode_after;
}

/// Touching contacts that the mode implies have no guards as long as it lasts. No step may move
/// them down.
void Flow::FindImplied() {
  if (system_.HasFriction()) return;
  const ConstraintSet rigid = mode_ - system_.compliant();
  ConstraintSet near;
  for (int i = 0; i < system_.num_constraints() && !rigid.Empty(); ++i) {
    if (mode_.Contains(i) || system_.compliant().Contains(i)) continue;
    const bool touches =
        std::abs(gaps_begin_.gap(i)) <= kImpliedReach * options_.absolute_tolerance;
    if (touches && std::abs(gaps_begin_.rate(i)) <= options_.speed_tolerance) near.Insert(i);
  }
  implied_.Find(system_, x_, dynamics_.u(), rigid, near, gaps_begin_.gap);
  // Nor has one that was just let off: it is on its way.
  if (last_transition_ && *last_transition_ == t_) {
    ConstraintSet off = transition_.grazed - mode_ - system_.compliant();
    for (int i : off) {  // others have thrown it down
      if (gaps_begin_.rate(i) < -options_.speed_tolerance) off.Erase(i);
    }
    implied_.Add(off, gaps_begin_.gap);
  }
  locator_.Ignore(implied_.constraints());
}

/// An implied contact that is this many reaches below where it was at the beginning of the arc, at
/// the end of the step, or −1.
int Flow::ImpliedThatMoved(double reaches) const {
  for (int i : implied_.constraints()) {
    const double moved = implied_.Moved(i, gaps_end_.gap);
    if (moved < -reaches * kImpliedReach * options_.absolute_tolerance) return i;
  }
  return -1;
}

/// One that has risen gets its guard back.
void Flow::ForgetRisen() {
  if (implied_.Empty()) return;
  for (int i : implied_.constraints()) {
    const double moved = implied_.Moved(i, gaps_end_.gap);
    if (moved > kImpliedReach * options_.absolute_tolerance) implied_.Erase(i);
  }
  locator_.Ignore(implied_.constraints());
}

}  // namespace contact_flow
