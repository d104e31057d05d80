// SPDX-License-Identifier: BSD-3-Clause
// What a Flow does at its events.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/flow/flow.h"
#include "contact_flow/model/driven.h"
#include "frictional_rest.h"
#include "guarded.h"
#include "src/dynamics/implied_contacts.h"
#include "src/dynamics/mode_selection.h"
#include "src/dynamics/sticking.h"
#include "step_constants.h"

namespace contact_flow {
namespace {

constexpr int kStallsToInsist = 2;
constexpr int kStallsForEach = 4;  // constraint, before the run ends
/// Rounding of a rate Da_i v, relative to its terms.
constexpr double kNoSpeed = 1e-12;
/// Bounces that accumulate come back within this many times what is left until then.
constexpr double kReturn = 3;

/// What moves no mass at x, as a text that follows; "" where M is regular.
std::string SingularMass(const MechanicalSystem& system, const Vector& x, const Vector& u,
                         ContactMode mode) {
  constexpr double kSingular = 1e-14;  // beside the diagonal
  constexpr double kPart = 0.1;        // of the largest entry of what moves together
  const int nq = system.num_positions(), d = system.dof();
  Matrix mass;
  Vector force;
  system.Dynamics(x.head(nq), x.tail(d), u, mode, &mass, &force);
  const Vector size = mass.diagonal().cwiseAbs().cwiseSqrt();
  if (!mass.allFinite() || !(size.minCoeff() > 0)) return "";
  mass = size.cwiseInverse().asDiagonal() * mass * size.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(mass);
  if (eigen.eigenvalues()(0) > d * kSingular) return "";
  const Vector moved = eigen.eigenvectors().col(0).cwiseAbs();
  std::string names;
  for (int i = 0; i < d; ++i) {
    if (moved(i) < kPart * moved.maxCoeff()) continue;
    names += (names.empty() ? "'" : ", '") + system.description().velocities[i] + "'";
  }
  return "; the mass matrix is singular there: " + names +
         " can move together and move no mass. Give what they carry an inertia, or begin elsewhere";
}

}  // namespace

TransitionRules Flow::Rules() const {
  ErrorTally error = start_error_;  // of the present arc and the one before
  if (!new_arc_) error.Continue(t_ - arc_begin_, arc_error_);
  return {options_.simultaneity_tolerance, options_.speed_tolerance,    options_.impact_law,
          options_.gap_tolerance,          options_.absolute_tolerance, stalls_ >= kStallsToInsist,
          options_.relative_tolerance,     options_.absolute_tolerance, error.error(),
          implied_.constraints()};
}

void Flow::Warn(Outcome code, const std::string& message) {
  if (num_warnings_++ < Trajectory::kMaxWarnings) warnings_.push_back({code, t_, message});
}

void Flow::StopWithoutSteps() {
  const auto& names = system_.description().constraints;
  Stop(Outcome::kNonFinite,
       too_quick_ >= 0 ? "constraint '" + names[guards_.ConstraintOf(too_quick_)] +
                             "' changes too quickly: no step size resolves it"
                       : "the motion leaves the model's domain: no step size is small enough" +
                             SingularMass(system_, x_, u(), mode_));
}

void Flow::WarnOfSharedForces() {
  const auto tell = [this](ContactMode contacts, const char* what) {
    std::ostringstream message;
    message.precision(12);
    message << "at t = " << t_ << " s contacts "
            << contacts.ToString(system_.description().constraints)
            << " share forces that are not unique, their rows being dependent; " << what;
    Warn(Outcome::kIndeterminateForces, message.str());
  };
  const ContactMode shared = dynamics_.shared() - dynamics_.springs();
  if (!(shared - shared_).Empty()) {
    shared_ = shared_ | shared;
    tell(shared,
         "the motion is. Those told of are the admissible ones with the smallest sum of squares");
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
  last_trigger_ = trigger_;
  if (stalls_ <= kStallsForEach * (system_.num_constraints() + 4)) return true;
  const std::string& name = system_.description().constraints[guards_.ConstraintOf(trigger_)];
  Stop(system_.HasFriction() ? Outcome::kChatter : Outcome::kBudgetExceeded,
       "events of constraint '" + name + "' follow each other without time between them");
  return false;
}

/// Applies the transition at (t_, x_); false when it cannot be, and the run ends before it.
bool Flow::PassTransition() {
  if (!GoesOn()) return false;
  // Words of many contacts take longer than steps do.
  if (system_.HasFriction()) next_clock_reading_ = attempts_;
  ResolvedTransition resolved = ResolveAtEvent();
  margins_.approach_speed = std::min(margins_.approach_speed, resolved.approach_speed);
  margins_.release_rate = std::min(margins_.release_rate, resolved.release_rate);
  if (!resolved.status.ok()) {
    status_ = resolved.status;
    return false;
  }
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
  last_transition_ = t_;
  ++transitions_;
  mode_ = transition_.mode_after;
  x_ = transition_.x_plus;
  TallyTransition();
  const std::optional<double> accumulation = Accumulation(resolved);
  if (!accumulation) return true;
  accumulation_time_ = *accumulation;
  if (CompleteZeno()) return true;
  std::ostringstream reason;
  reason.precision(12);
  const std::string& name = system_.description().constraints[guards_.ConstraintOf(trigger_)];
  reason << "impacts of constraint '" << name << "' accumulate at t = " << *accumulation
         << " s (Zeno)";
  Stop(Outcome::kZeno, reason.str());
  return true;
}

/// What the errors of the last arc become by its event. Those of longer ago are those of all events
/// to come alike, or have been forgotten.
void Flow::TallyTransition() {
  start_error_ = arc_error_;
  if (transition_.activated.Empty()) return;
  const int d = system_.dof();
  const Vector v_minus = transition_.x_minus.tail(d);
  system_.Constraints(transition_.x_minus.head(system_.num_positions()), v_minus, &terms_);
  Matrix rows(transition_.activated.Size(), d);
  Eigen::Index row = 0;
  for (int i : transition_.activated) rows.row(row++) = terms_.jacobian.row(i);
  start_error_.AddImpact(rows, rows * v_minus, transition_.x_plus.tail(d) - v_minus);
  const ContactMode open = ContactMode::All(system_.num_constraints()) - mode_;
  for (int i : open - system_.compliant() - implied_.constraints()) {
    const double gap = terms_.gap(i);
    if (gap > options_.absolute_tolerance) continue;
    if (transition_.activated.Contains(i) || transition_.mode_before.Contains(i)) continue;
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

/// When the impacts up to this transition accumulate [s], if they do: intervals that shrink
/// geometrically and have shrunk by the stated factor, the next one being known where its bounce
/// was made rest; or a bounce of an elastic contact that is too low to be resolved.
std::optional<double> Flow::Accumulation(const ResolvedTransition& resolved) {
  const ContactMode impacts =
      transition_.activated | (transition_.grazed - transition_.mode_before);
  if (impacts.Empty()) return std::nullopt;
  std::optional<double> accumulation = zeno_.Impact(impacts, t_);
  if (!accumulation && resolved.rest_interval > 0) {
    accumulation = zeno_.ImpactTo(t_ + resolved.rest_interval);
  }
  for (int i : impacts - system_.compliant()) {
    if (!accumulation) accumulation = PredictRest(i);
  }
  return accumulation;
}

/// The end of the bounces of elastic contact i [s] if the next no longer reaches the absolute
/// tolerance: under constant acceleration −b, from speed v on, it rises to v²/(2b) and all of them
/// take 2v/(b (1 − γ)).
std::optional<double> Flow::PredictRest(int i) {
  const double restitution = system_.restitution()(i);
  if (restitution <= 0 || restitution >= 1 || mode_.Contains(i)) return std::nullopt;
  const int d = system_.dof(), nq = system_.num_positions();
  dynamics_.Evaluate(x_, mode_);
  system_.Constraints(x_.head(nq), x_.tail(d), &terms_);
  const double speed = terms_.jacobian.row(i).dot(x_.tail(d));
  const double back = -(terms_.jacobian.row(i).dot(dynamics_.acceleration()) + terms_.bias(i));
  if (speed < 0 || !(speed * speed <= 2 * back * options_.absolute_tolerance)) return std::nullopt;
  return t_ + (speed > 0 ? 2 * speed / (back * (1 - restitution)) : 0);
}

/// The contacts at the last impact that rest when its bounces have come to their end: those that
/// rest, and those that are back by then. What an impact lifts for longer is none of them.
ContactMode Flow::EndOfBounces() {
  const int d = system_.dof(), nq = system_.num_positions();
  const ContactMode rest = transition_.mode_after.Members();
  const ContactMode touched =
      transition_.mode_before.Members() | transition_.activated | transition_.grazed;
  dynamics_.Evaluate(x_, mode_);
  system_.Constraints(x_.head(nq), x_.tail(d), &terms_);
  ContactMode end = rest;
  for (int i : touched - rest) {
    const double speed = terms_.jacobian.row(i).dot(x_.tail(d));
    const double back = -(terms_.jacobian.row(i).dot(dynamics_.acceleration()) + terms_.bias(i));
    const bool returns = 2 * speed <= kReturn * (accumulation_time_ - t_) * back;
    if (speed <= options_.speed_tolerance || returns) end.Insert(i);
  }
  return end - system_.compliant();
}

/// Turns the last impact into rest at the EndOfBounces: see SimulateOptions::complete_zeno. False
/// where the run is to stop instead.
bool Flow::CompleteZeno() {
  Transition last = transition_;
  const int d = system_.dof(), nq = system_.num_positions();
  ContactMode sticking = EndOfBounces();
  const InverseInertia inertia(system_, x_.head(nq), x_.tail(d));
  bool plastic = true;
  for (int i : last.activated | last.grazed) plastic = plastic && system_.restitution()(i) == 0;
  if (system_.HasFriction()) {
    const auto rest = RestOfBounces(&dynamics_, last, sticking, options_.gap_tolerance);
    if (!rest) return false;
    last.energy_lost += rest->energy_lost;
    if (!options_.complete_zeno && !plastic) return false;
    sticking = rest->closed;
    last.x_plus.tail(d) = rest->v_plus;
    last.mode_after = rest->mode;
  } else {
    ImpactResult impact;
    const Status stuck =
        Guarded(t_, [&] { impact = Stick(system_, x_.head(nq), last.x_minus.tail(d), sticking); });
    if (!stuck.ok()) return false;
    const double rest = KineticEnergy(inertia.mass(), impact.v_plus);
    // M-orthogonal to what sticks: |v|² − |v⁺|² seen from the surfaces, which may be driven.
    last.energy_lost += KineticEnergy(inertia.mass(), last.x_plus.tail(d) - impact.v_plus);
    if (!options_.complete_zeno && !(plastic && last.energy_lost < rest)) return false;
    last.x_plus.tail(d) = impact.v_plus;
    if (options_.complete_zeno) last.impulse = impact.impulse;
    const ContactMode pressed = last.mode_after & system_.compliant();
    status_ = Guarded(t_, [&] {
      const ModeSelection selection =
          SelectMode(&dynamics_, last.x_plus, sticking, last.tolerance, pressed);
      last.mode_after = selection.mode;
      last.implied = selection.implied;
    });
  }
  last.completes_zeno = true;
  last.released = last.mode_before - last.mode_after;
  transition_ = std::move(last);
  mode_ = transition_.mode_after;
  x_ = transition_.x_plus;
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << t_ << " s impacts of "
          << sticking.ToString(system_.description().constraints) << " that accumulate at "
          << accumulation_time_ << " s are completed to sticking: " << transition_.energy_lost
          << " J are lost";
  Warn(Outcome::kZeno, message.str());
  return true;
}

/// Contacts that rest, or stick, as the run begins have no speed: what the start leaves of it, below
/// the tolerance, is taken away, if integration would not leave as much. Slips in space that begin
/// with the run get their directions, as at a change of the input.
void Flow::BeginAtRest() {
  SampleGaps(system_, x_, Vector::Zero(system_.dof()), &terms_, &gaps_begin_);
  const ContactMode rigid = mode_ - system_.compliant();
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
  const ContactMode rigid = mode_ - system_.compliant();
  ContactMode near;
  for (int i = 0; i < system_.num_constraints() && !rigid.Empty(); ++i) {
    if (mode_.Contains(i) || system_.compliant().Contains(i)) continue;
    const bool touches =
        std::abs(gaps_begin_.gap(i)) <= kImpliedReach * options_.absolute_tolerance;
    if (touches && std::abs(gaps_begin_.rate(i)) <= options_.speed_tolerance) near.Insert(i);
  }
  implied_.Find(system_, x_, dynamics_.u(), rigid, near, gaps_begin_.gap);
  // Nor has one that was just let off: it is on its way.
  if (last_transition_ && *last_transition_ == t_) {
    implied_.Add(transition_.grazed - mode_ - system_.compliant(), gaps_begin_.gap);
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
