// SPDX-License-Identifier: BSD-3-Clause
#include "end_event.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/model/driven.h"

namespace contact_flow {
namespace {

/// Rounding of instants, of gaps beside the coordinates, and of rates beside their terms.
constexpr double kTimeRounding = 1e-15, kGapRounding = 1e-15, kRateRounding = 1e-12;
/// Entries of F that differ by no more, beside their sizes and beside the largest, are the same.
constexpr double kSameEndField = 1e-6, kNoJump = 1e-9;
/// A slip that would take longer to stop than this part of the run creeps; the same of a force.
constexpr double kCreeping = 1e-6;
/// A gap is not known to miss zero within this many absolute tolerances, as along a run; and
/// accelerations of gaps below this part of their terms may be none.
constexpr double kGrazeReach = 10, kNoCurvature = 1e-9;

/// The end of a run beside the events that are as near to it as their instants are known.
class EndOfRun {
 public:
  EndOfRun(const MechanicalSystem& system, const Trajectory& run, const Vector& state_error)
      : system_(system),
        run_(run),
        last_(run.arcs.back()),
        rounding_(kTimeRounding * std::max(std::abs(run.t_end()), run.t_end() - run.t_begin())),
        error_q_(kInstantErrors * state_error.head(system.dof())),
        error_v_(kInstantErrors * state_error.segment(system.dof(), system.dof())),
        q_(last_.x_end.head(system.num_positions())),
        v_(last_.x_end.tail(system.dof())) {
    system_.Constraints(q_, v_, &terms_);
  }

  Status Check(ConstraintSet* switches) {
    if (switches != nullptr) of_time_ = DrivenSwitches(system_, q_, v_);
    const Status status = CheckAll();
    if (switches != nullptr) *switches = met_;
    return status;
  }

 private:
  Status CheckAll() {
    for (const Transition& passed : run_.transitions) {
      const Status status = CheckPassed(passed);
      if (!status.ok()) return status;
    }
    for (int i = 0; i < system_.num_constraints(); ++i) {
      Status status = CheckGraze(i);
      if (status.ok()) status = CheckGap(i);
      if (!status.ok()) return status;
    }
    for (int i : last_.mode) {
      Status status = CheckSlip(i);
      if (status.ok()) status = CheckHold(i);
      if (!status.ok()) return status;
    }
    return {};
  }

  Status CheckPassed(const Transition& passed) {
    const ConstraintSet hit = passed.activated - system_.compliant();
    const Vector jump = (passed.x_plus - passed.x_minus).tail(system_.dof()).cwiseAbs();
    const bool jumps = !hit.Empty() && !(jump.array() <= error_v_.array()).all();
    double error = rounding_;
    for (const EventInstant& instant : passed.instants) {
      if (jumps && !hit.Contains(instant.constraint)) continue;
      error = std::max(error, kInstantErrors * instant.error);
    }
    const double apart = run_.t_end() - passed.t;
    if (apart <= Creeps()) error = std::max(error, SlipLeft(passed));
    if (apart > error) return {};
    if (jumps) return Jumps(*hit.begin(), passed.t, apart, error);
    if (passed.changes_input || !FieldJumps(passed)) return {};
    const ConstraintSet changed = Changed(passed);
    if (!changed.Empty() && (changed - of_time_).Empty()) {
      met_ = met_ | changed;
      return {};
    }
    return Bends(changed.Empty() ? -1 : *changed.begin(), passed.t, apart, error);
  }

  /// Constraints that do something else behind the transition.
  static ConstraintSet Changed(const Transition& passed) {
    ConstraintSet changed = passed.switched | passed.activated | passed.released;
    for (int i : passed.mode_before | passed.mode_after) {
      if (passed.mode_before.LetterOf(i) != passed.mode_after.LetterOf(i)) changed.Insert(i);
    }
    return changed;
  }

  /// A slip in space has no sign that changes: it is stopped while a little of it is left, which
  /// would take so long yet [s].
  double SlipLeft(const Transition& passed) const {
    double left = 0;
    for (int i : passed.mode_before& passed.mode_after) {
      const bool stops = passed.mode_before.LetterOf(i) == Letter::kSlip &&
                         passed.mode_after.LetterOf(i) == Letter::kStick;
      if (!stops || !passed.activated.Empty()) continue;
      const GuardJet slip = SlipOf(i, passed.x_minus, passed.mode_before);
      if (slip.rate < 0) left = std::max(left, kInstantErrors * slip.value / -slip.rate);
    }
    return left;
  }

  /// The guard of contact i that slips; its rate is NaN where there are no forces, of which the
  /// run has told.
  GuardJet SlipOf(int i, const Vector& x, ContactMode mode) const {
    const Vector v = x.tail(system_.dof());
    ConstraintTerms terms;
    system_.Constraints(x.head(system_.num_positions()), v, &terms);
    Vector acceleration = Vector::Constant(v.size(), std::numeric_limits<double>::quiet_NaN());
    try {
      ContactDynamics dynamics(system_, last_.u);
      dynamics.Evaluate(x, mode);
      acceleration = dynamics.acceleration();
    } catch (const FrictionRefusal&) {  // the acceleration stays unknown
    }
    const Guards guards(system_);
    return guards.OfMotion(guards.OfFriction(i), mode, terms, v, acceleration);
  }

  /// F is continuous where slips begin, whose direction at no speed the state does not tell.
  bool FieldJumps(const Transition& passed) const {
    bool only_begin = passed.switched.Empty() && passed.activated.Empty();
    for (int i : passed.mode_before | passed.mode_after) {
      const Letter before = passed.mode_before.LetterOf(i), after = passed.mode_after.LetterOf(i);
      only_begin =
          only_begin && (before == after || (before == Letter::kStick && after != Letter::kOpen));
    }
    if (only_begin) return false;
    return Differ(passed.x_minus, passed.mode_before, passed.x_plus, passed.mode_after);
  }
  bool Differ(const Vector& x, ContactMode mode, const Vector& y, ContactMode other) const {
    try {
      ContactDynamics dynamics(system_, last_.u);
      const Vector before = dynamics.Field(x, mode), after = dynamics.Field(y, other);
      const double nothing =
          kNoJump * std::max(before.cwiseAbs().maxCoeff(), after.cwiseAbs().maxCoeff());
      const auto sizes = kSameEndField * (before.cwiseAbs() + after.cwiseAbs()).array() + nothing;
      return !((after - before).array().abs() <= sizes).all();  // NaN, too
    } catch (const FrictionRefusal&) {
      return true;
    }
  }

  /// A gap that came down to zero and opens again, as near to the end as gaps are known: runs that
  /// touch before have another velocity, by the square root of what they differ in.
  Status CheckGraze(int i) const {
    const bool compliant = system_.compliant().Contains(i), holds = last_.mode.Contains(i);
    if ((holds && !compliant) || last_.dense.Empty()) return {};
    const double sign = Guards::GapSign(i, last_.mode);
    const auto row = terms_.jacobian.row(i);
    const double reach = kGrazeReach * run_.absolute_tolerance + row.cwiseAbs().dot(error_q_);
    const double gap = sign * terms_.gap(i), rate = sign * row.dot(v_);
    if (!(std::abs(gap) <= reach)) return {};
    const double opens = sign * Opening(i);
    if (!(opens > 0) || rate * rate > 2 * opens * (gap + reach)) return {};
    // Where it would be twice as high, it was.
    const double before = run_.t_end() - std::sqrt(4 * reach / opens);
    const Vector x = run_.State(std::max(before, run_.t_begin()));
    ConstraintTerms terms;
    system_.Constraints(x.head(system_.num_positions()), x.tail(system_.dof()), &terms);
    if (!(sign * terms.gap(i) > reach)) return {};
    const ContactMode other = holds ? last_.mode.Without(i) : last_.mode.With(i);
    if (compliant && !Differ(last_.x_end, last_.mode, last_.x_end, other)) return {};
    std::ostringstream message;
    message.precision(12);
    message << "constraint '" << system_.description().constraints[i]
            << "' is touched at t = " << run_.t_end() - rate / opens << " s with normal velocity "
            << rate
            << " m/s, and the run ends there as far as it is known: grazing, not admissible";
    return {Outcome::kGrazing, message.str()};
  }

  /// The acceleration of gap i at the end, 0 where it may be none.
  double Opening(int i) const {
    try {
      ContactDynamics dynamics(system_, last_.u);
      dynamics.Evaluate(last_.x_end, last_.mode);
      const auto row = terms_.jacobian.row(i);
      const Vector& acceleration = dynamics.acceleration();
      const double size = row.cwiseAbs().dot(acceleration.cwiseAbs()) + std::abs(terms_.bias(i));
      const double opening = row.dot(acceleration) + terms_.bias(i);
      return std::abs(opening) > kNoCurvature * size ? opening : 0;
    } catch (const FrictionRefusal&) {
      return 0;
    }
  }

  /// A rigid constraint that is about to be hit, a compliant one about to be passed.
  Status CheckGap(int i) {
    const bool compliant = system_.compliant().Contains(i), holds = last_.mode.Contains(i);
    if (holds && !compliant) return {};
    const auto row = terms_.jacobian.row(i);
    const auto size = row.cwiseAbs();
    const double towards = holds ? row.dot(v_) : -row.dot(v_);
    const double known = std::max(
        {run_.speed_tolerance, size.dot(error_v_), kRateRounding * size.dot(v_.cwiseAbs())});
    if (towards <= known) return {};
    const double far = q_.cwiseAbs().maxCoeff();
    const double error =
        (size.dot(error_q_) + kGapRounding * size.maxCoeff() * far) / towards + rounding_;
    const double apart = (holds ? -terms_.gap(i) : terms_.gap(i)) / towards;
    if (apart > error) return {};
    if (!compliant) return Jumps(i, run_.t_end() + apart, apart, error);
    const ContactMode other = holds ? last_.mode.Without(i) : last_.mode.With(i);
    if (!Differ(last_.x_end, last_.mode, last_.x_end, other)) return {};
    if (of_time_.Contains(i)) {
      met_.Insert(i);
      return {};
    }
    return Bends(i, run_.t_end() + apart, apart, error);
  }

  /// A slip that is about to stop, or to turn round.
  Status CheckSlip(int i) const {
    if (!system_.HasFriction() || last_.t_end == last_.t_begin) return {};
    const Friction& friction = system_.friction()[i];
    const Letter letter = last_.mode.LetterOf(i);
    if (friction.dimension == 0 || friction.coefficient == 0 || letter == Letter::kStick) return {};
    const Matrix T = terms_.jacobian.middleRows(friction.row, friction.dimension);
    const Matrix size = T.cwiseAbs();
    const double known = std::max({run_.absolute_tolerance, (size * error_v_).norm(),
                                   kRateRounding * (size * v_.cwiseAbs()).norm()});
    const double sign = SlipSign(letter);
    if ((friction.dimension == 2 ? (T * v_).norm() : sign * (T * v_)(0)) > known) return {};
    const GuardJet slip = SlipOf(i, last_.x_end, last_.mode);
    const double apart = slip.value / -slip.rate;
    if (!(slip.rate < 0) || std::abs(apart) > Creeps()) return {};
    return Bends(i, run_.t_end() + apart, apart, known / -slip.rate);
  }

  /// A contact that never slips is about to let go, of a force along the ground, too.
  Status CheckHold(int i) const {
    if (!system_.HasFriction() || last_.t_end == last_.t_begin) return {};
    if (system_.friction()[i].coefficient != Friction::kNoSlip) return {};
    try {
      ContactDynamics dynamics(system_, last_.u);
      const double slower = -dynamics.ForceRate(last_.x_end, last_.mode, i);
      const double apart = dynamics.force()(i) / slower;
      if (!(slower > 0) || !(apart <= Creeps())) return {};
      dynamics.Differentiate(last_.x_end, last_.mode);
      const int d = system_.dof();
      const auto row = dynamics.force_jacobian().row(i).cwiseAbs();
      const double error =
          rounding_ + (row.head(d).dot(error_q_) + row.segment(d, d).dot(error_v_) +
                       kRateRounding * dynamics.force().cwiseAbs().maxCoeff()) /
                          slower;
      const bool near = apart <= error;
      if (!near || !Differ(last_.x_end, last_.mode, last_.x_end, last_.mode.Without(i))) return {};
      return Bends(i, run_.t_end() + apart, apart, error);
    } catch (const FrictionRefusal&) {
      return {};
    }
  }

  /// What takes longer is no event, however slow it is.
  double Creeps() const {
    return kCreeping * std::max(std::abs(run_.t_end()), last_.t_end - last_.t_begin);
  }

  std::ostringstream Near(const char* what, int i, double t, double apart, double error) const {
    std::ostringstream message;
    message.precision(12);
    if (i >= 0) {
      message << "constraint '" << system_.description().constraints[i] << "' " << what
              << " at t = ";
    } else {
      message << "the field changes at t = ";
    }
    message << t << " s, and the run ends there as far as it is known (" << apart
            << " s apart, error " << error
            << " s): in runs that meet it earlier or later the outcome ";
    return message;
  }
  Status Jumps(int i, double t, double apart, double error) const {
    std::ostringstream message = Near("is hit", i, t, apart, error);
    message << "differs by its jump";
    return {Outcome::kDiscontinuous, message.str()};
  }
  Status Bends(int i, double t, double apart, double error) const {
    std::ostringstream message = Near("changes its mode", i, t, apart, error);
    message << "has another slope, since accelerations jump";
    return {Outcome::kNotDifferentiable, message.str()};
  }

  const MechanicalSystem& system_;
  const Trajectory& run_;
  const Arc& last_;
  const double rounding_;
  const Vector error_q_, error_v_;  // of the last state
  const Vector q_, v_;
  ConstraintTerms terms_;
  ConstraintSet of_time_, met_;  // switches of time, and those at the end
};

}  // namespace

Status CheckEnd(const MechanicalSystem& system, const Trajectory& run, const Vector& state_error,
                ConstraintSet* switches) {
  if (switches != nullptr) *switches = {};
  if (!state_error.allFinite()) return {};
  return EndOfRun(system, run, state_error).Check(switches);
}

Vector SideOfSwitch(const MechanicalSystem& system, const Trajectory& run,
                    const Variables& variables, double ahead, int constraint) {
  const int nq = system.num_positions(), d = system.dof();
  const Vector q = run.FinalState().head(nq), v = run.FinalState().tail(d);
  ConstraintTerms terms;
  system.Constraints(q, v, &terms);
  const Vector row = terms.jacobian.row(constraint);
  Vector side = Vector::Zero(2 * d + variables.Size(system));
  side.head(d) = row;
  side.segment(d, d) = ahead * row;  // rates of clocks are constant
  const auto parameters = static_cast<Eigen::Index>(variables.parameters.size());
  if (parameters > 0) {
    ParameterJacobian by_parameter;
    system.DifferentiateImpactByParameters(q, Vector::Zero(d), Vector::Zero(terms.gap.size()), v,
                                           variables.parameters, &by_parameter);
    side.tail(parameters) = by_parameter.gap.row(constraint);
  }
  return run.arcs.back().mode.Contains(constraint) ? Vector(-side) : side;
}

}  // namespace contact_flow
