// SPDX-License-Identifier: BSD-3-Clause
// Transitions of systems with friction.
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/implied_contacts.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/transition.h"
#include "guarded.h"
#include "slip_onset.h"
#include "stop_in_space.h"

namespace contact_flow {
namespace {

/// Of rates, relative to the sum of the sizes of their terms.
constexpr double kRounding = 1e-12;
/// How closely the inequalities of a word have to hold, at least.
constexpr double kBorder = 1e-10;
/// What a gap is known to, relative to the coordinates.
constexpr double kUnits = 1e-14;
/// A slip in space that begins has this many absolute tolerances.
constexpr double kOnset = 10;

class FrictionalResolution {
 public:
  FrictionalResolution(ContactDynamics* dynamics, double t, const Vector& x, ContactMode mode,
                       const TransitionRules& rules)
      : dynamics_(*dynamics),
        system_(dynamics->system()),
        guards_(system_),
        rules_(rules),
        nq_(system_.num_positions()),
        d_(system_.dof()) {
    result_.approach_speed = result_.release_rate = std::numeric_limits<double>::infinity();
    Transition& cluster = result_.transition;
    cluster.t = t;
    cluster.x_minus = cluster.x_plus = x;
    cluster.mode_before = cluster.mode_after = mode;
    cluster.impulse = Vector::Zero(system_.num_rows());
    cluster.relative_tolerance = rules.relative_tolerance;
    cluster.absolute_tolerance = rules.absolute_tolerance;
    system_.Constraints(x.head(nq_), x.tail(d_), &terms_);
    rate_ = terms_.jacobian * x.tail(d_);
  }

  /// The guards that vanish together with the trigger.
  void Collect(int trigger) {
    Transition& cluster = result_.transition;
    const Vector& x = cluster.x_minus;
    const ContactMode mode = cluster.mode_before;
    dynamics_.Differentiate(x, mode);
    const Matrix force_jacobian = dynamics_.force_jacobian();
    const Vector field = dynamics_.Field(x, mode).head(2 * d_);
    ResidualJacobian slip;
    system_.DifferentiateImpact(x.head(nq_), Vector::Zero(d_), Vector::Zero(system_.num_rows()),
                                x.tail(d_), &slip);
    Vector error = Vector::Zero(2 * d_);
    if (rules_.state_error.size() > 0) {
      error = rules_.state_error;
      error.head(d_).array() += kUnits * x.head(nq_).cwiseAbs().maxCoeff();
    }
    struct Zero {
      int guard;
      double value, slope, error;
    };
    std::vector<Zero> zeros;
    const ContactMode forces = guards_.OfForces(mode, dynamics_.shared()),
                      slips = guards_.OfSlips(mode);
    const ContactMode open = ContactMode::All(system_.num_constraints()) - mode;
    double own = 0;
    for (int g : forces | slips | open) {
      Eigen::RowVectorXd gradient = Eigen::RowVectorXd::Zero(2 * d_);
      double value;
      if (forces.Contains(g)) {
        value = guards_.OfForce(g, dynamics_);
        gradient = guards_.GradientOfForce(g, dynamics_, force_jacobian).leftCols(2 * d_);
      } else if (guards_.IsNormal(g)) {
        value = terms_.gap(g);
        gradient.head(d_) = terms_.jacobian.row(g);
      } else {
        const double sign = guards_.SlipSign(g, mode);
        const int row = guards_.SlipRow(g);
        value = sign * rate_(row);
        gradient << sign * slip.constraint_q.row(row), sign * terms_.jacobian.row(row);
      }
      const double slope = gradient.dot(field);
      const double unsure = gradient.cwiseAbs().dot(error) / std::abs(slope);
      if (g == trigger) own = std::isfinite(unsure) ? unsure : 0;
      zeros.push_back({g, value, slope, unsure});
    }
    if (!(forces | slips | open).Contains(trigger)) {  // a slip in space has come to its end
      const int i = guards_.ConstraintOf(trigger);
      stopped_ = StoppedTogether(system_, terms_, dynamics_.acceleration(), i, &cluster);
      cluster.guards.push_back(trigger);
    }
    const double asked = rules_.simultaneity_tolerance;
    cluster.tolerance = asked > 0 ? asked : kInstantErrors * own;
    double first = std::numeric_limits<double>::infinity(), last = -first;
    std::vector<std::pair<double, int>> order;
    for (const Zero& zero : zeros) {
      const double within = asked > 0 ? asked : kInstantErrors * (own + zero.error);
      const bool counts =
          zero.guard == trigger || (zero.slope < 0 && zero.value <= -zero.slope * within &&
                                    zero.value >= zero.slope * within);
      if (!counts) continue;
      const double offset = zero.slope != 0 ? -zero.value / zero.slope : 0;
      order.emplace_back(offset, zero.guard);
      first = std::min(first, offset);
      last = std::max(last, offset);
      cluster.instants.push_back({guards_.ConstraintOf(zero.guard), offset, zero.error});
      Note(zero.guard, zero.slope);
    }
    std::sort(order.begin(), order.end());
    for (const auto& one : order) cluster.guards.push_back(one.second);
    cluster.spread = std::max(0.0, last - first);
  }

  void Decide() {
    Transition& cluster = result_.transition;
    const Vector v_minus = cluster.x_minus.tail(d_);
    const ContactMode before = cluster.mode_before.Members();
    ContactMode touching = before | cluster.activated | grazed_;
    for (int i = 0; i < system_.num_constraints(); ++i) {
      if (std::abs(terms_.gap(i)) > rules_.gap_tolerance) continue;
      if (std::abs(rate_(i)) <= Rounding(i, v_minus)) touching.Insert(i);
    }
    touching = touching | AddImplied(touching);
    const ContactMode beside = touching - before - cluster.activated;
    Vector v_plus = v_minus;
    ContactMode held;  // by the impact
    ContactMode still = cluster.mode_before.Sticking() | stopped_;
    if (!cluster.activated.Empty()) {
      const FrictionalImpact impact =
          SolveFrictionalImpact(system_, cluster.x_minus.head(nq_), v_minus, touching);
      v_plus = impact.result.v_plus;
      cluster.impulse = impact.result.impulse;
      cluster.impulse_word = impact.word;
      cluster.energy_change = impact.energy_change;
      still = impact.word.Sticking();
      for (int i : impact.word.Members()) {
        const bool bounces = cluster.activated.Contains(i) && system_.restitution()(i) > 0;
        if (!bounces) held.Insert(i);
      }
      for (int i : before - impact.word) {
        if (cluster.mode_before.LetterOf(i) == Letter::kStick) still.Insert(i);
      }
    }
    still = still | ImpliedStill(system_, cluster.x_minus, touching, still & touching);
    const Vector rate = terms_.jacobian * v_plus;
    TouchingContacts contacts;
    for (int i : touching) {
      const bool bounced = cluster.activated.Contains(i) && system_.restitution()(i) > 0;
      const double rest = std::max(Rounding(i, v_plus), bounced ? 0 : Drift(i));
      if (!held.Contains(i) && rate(i) > rest) continue;  // it leaves
      Sort(i, rate, v_plus, still, &contacts);
    }
    cluster.x_plus.tail(d_) = v_plus;
    SetLetters(contacts);
    cluster.touching = beside & (cluster.impulse_word | cluster.mode_after);
  }

  /// Where nothing but the input changes.
  void DecideInput() {
    TouchingContacts contacts;
    const Vector v = result_.transition.x_minus.tail(d_);
    const ContactMode mode = result_.transition.mode_before;
    for (int i = 0; i < system_.num_constraints(); ++i) {
      const bool touches =
          std::abs(terms_.gap(i)) <= rules_.gap_tolerance && std::abs(rate_(i)) <= Rounding(i, v);
      if (mode.Contains(i) || touches) Sort(i, rate_, v, mode.Sticking(), &contacts);
    }
    SetLetters(contacts);
    result_.transition.touching = result_.transition.mode_after.Members() - mode;
  }

  ResolvedTransition Take() { return std::move(result_); }

 private:
  double Rounding(int row, const Vector& v) const {
    return kRounding * terms_.jacobian.row(row).cwiseAbs().dot(v.cwiseAbs());
  }
  /// A contact that rested before may have drifted by the integrator's error.
  double Drift(int i) const {
    return result_.transition.mode_before.Contains(i) ? 10 * std::abs(rate_(i)) : 0;
  }

  /// Contacts that the others of one body bring along, a gap that is a sum of theirs: they land
  /// with them, or touch.
  ContactMode AddImplied(ContactMode touching) {
    ContactMode near;
    for (int i : ContactMode::All(system_.num_constraints()) - touching) {
      if (std::abs(terms_.gap(i)) <= rules_.gap_tolerance) near.Insert(i);
    }
    Transition& cluster = result_.transition;
    const ContactMode implied = ImpliedClosed(system_, cluster.x_minus, touching, near);
    for (int i : implied) {
      if (rate_(i) < -Rounding(i, cluster.x_minus.tail(d_))) cluster.activated.Insert(i);
    }
    return implied;
  }

  void Note(int guard, double slope) {
    Transition& cluster = result_.transition;
    const int i = guards_.ConstraintOf(guard);
    const bool member = cluster.mode_before.Contains(i);
    if (guards_.IsNormal(guard) && !member) {
      const double still =
          std::max(Rounding(i, cluster.x_minus.tail(d_)),
                   std::min(rules_.speed_tolerance, 1e3 * rules_.absolute_tolerance));
      if (slope < -still) {
        cluster.activated.Insert(i);
        result_.approach_speed = std::min(result_.approach_speed, -slope);
        return;
      }
      grazed_.Insert(i);
      Obstruct(i, "is touched with normal velocity", slope, "m/s");
      return;
    }
    if (guards_.IsNormal(guard)) {
      cluster.vanishing.Insert(i);
      result_.release_rate = std::min(result_.release_rate, -slope);
      if (!(slope < 0)) Obstruct(i, "lets go with a force rate of", slope, "N/s");
    } else if (guards_.OfSlips(cluster.mode_before).Contains(guard)) {
      stopped_.Insert(i);
      if (!(slope < 0)) Obstruct(i, "stops slipping with an acceleration of", slope, "m/s^2");
    } else if (!(slope < 0)) {
      Obstruct(i, "reaches its friction cone at a rate of", slope, "N/s");
    }
  }

  void Obstruct(int i, const char* what, double slope, const char* unit) {
    std::ostringstream message;
    message.precision(12);
    message << "at t = " << result_.transition.t << " s contact '"
            << system_.description().constraints[i] << "' " << what << ' ' << slope << ' ' << unit
            << ": grazing";
    result_.transition.grazed.Insert(i);
    result_.transition.obstacle = {Outcome::kGrazing, message.str()};
    result_.warnings.push_back({Outcome::kGrazing, result_.transition.t, message.str()});
  }

  /// Whether contact i is still, or slips, and which way.
  void Sort(int i, const Vector& rate, const Vector& v, ContactMode still,
            TouchingContacts* contacts) const {
    const Friction& friction = system_.friction()[i];
    if (friction.dimension == 0 || friction.coefficient == 0) {
      contacts->slipping.Insert(i);
      return;
    }
    const auto slip = rate.segment(friction.row, friction.dimension);
    double rounding = 0;
    for (int k = 0; k < friction.dimension; ++k) {
      rounding = std::max(rounding, Rounding(friction.row + k, v));
    }
    if (std::isinf(friction.coefficient) || still.Contains(i) || slip.norm() <= rounding) {
      const Letter letter = result_.transition.mode_before.LetterOf(i);
      const bool begun = (letter == Letter::kForward || letter == Letter::kBackward) &&
                         !still.Contains(i) && result_.transition.activated.Empty();
      if (begun) {  // it has only just begun to slip
        contacts->slipping.Set(i, letter);
      } else {
        contacts->still.Insert(i);
      }
      return;
    }
    if (friction.dimension == 2) {
      contacts->slipping.Insert(i);
      return;
    }
    const Letter letter = result_.transition.mode_before.LetterOf(i);
    const bool keeps = result_.transition.activated.Empty() &&
                       (letter == Letter::kForward || letter == Letter::kBackward);
    contacts->slipping.Set(i, keeps ? letter : slip(0) > 0 ? Letter::kForward : Letter::kBackward);
  }

  void SetLetters(const TouchingContacts& contacts) {
    Transition& cluster = result_.transition;
    cluster.mode_after = SelectWord(&dynamics_, cluster.x_plus, contacts, kBorder);
    ContactMode begins;
    for (int i : cluster.mode_after & contacts.still) {
      const bool in_space =
          system_.friction()[i].dimension == 2 && system_.friction()[i].coefficient > 0;
      if (in_space && cluster.mode_after.LetterOf(i) == Letter::kSlip) begins.Insert(i);
    }
    if (begins.Empty()) return Rest({});
    cluster.obstacle = {Outcome::kNotPiecewiseLinear,
                        "contacts " + begins.ToString(system_.description().constraints) +
                            " begin to slip in space: derivatives across that are not offered"};
    Rest(OnsetDirections(&dynamics_, cluster.x_plus, contacts, cluster.mode_after, begins,
                         kBorder));
  }

  void Rest(const std::map<int, Eigen::Vector2d>& onsets) {
    Vector& x = result_.transition.x_plus;
    const double size = kOnset * std::max(rules_.absolute_tolerance,
                                          kRounding * x.tail(d_).cwiseAbs().maxCoeff());
    MakeRest(system_, result_.transition.mode_after, onsets, size, &x);
  }

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Guards guards_;
  const TransitionRules& rules_;
  const int nq_, d_;
  ConstraintTerms terms_;
  Vector rate_;          // of all rows
  ContactMode stopped_;  // whose slip ends here
  ContactMode grazed_;   // touched without speed
  ResolvedTransition result_;
};

}  // namespace

ResolvedTransition ResolveFriction(ContactDynamics* dynamics, double t, const Vector& x,
                                   ContactMode mode, int trigger, const TransitionRules& rules) {
  FrictionalResolution resolution(dynamics, t, x, mode, rules);
  const Status status = Guarded(t, [&] {
    resolution.Collect(trigger);
    resolution.Decide();
  });
  ResolvedTransition result = resolution.Take();
  result.status = status;
  result.transition.released = mode.Members() - result.transition.mode_after;
  return result;
}

ResolvedTransition ResolveFrictionalInput(ContactDynamics* dynamics, double t, const Vector& x,
                                          ContactMode mode, const TransitionRules& rules) {
  FrictionalResolution resolution(dynamics, t, x, mode, rules);
  const Status status = Guarded(t, [&] { resolution.DecideInput(); });
  ResolvedTransition result = resolution.Take();
  result.status = status;
  result.transition.changes_input = true;
  result.transition.released = mode.Members() - result.transition.mode_after;
  return result;
}

}  // namespace contact_flow
