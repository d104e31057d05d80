// SPDX-License-Identifier: BSD-3-Clause
// Transitions of systems with friction.
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/implied_contacts.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/force_slack.h"
#include "contact_flow/flow/transition.h"
#include "guard_zeros.h"
#include "guarded.h"
#include "resolution.h"
#include "slip_onset.h"
#include "stop_in_space.h"

namespace contact_flow {
namespace {

/// How closely the inequalities of a word have to hold, at least.
constexpr double kBorder = 1e-10;
/// A slip in space that begins has this many absolute tolerances, or what it gains in this time,
/// relative to max(1, t): its direction is followed by steps that take less than it has lasted.
constexpr double kOnset = 10, kOnsetTime = 1e-12;

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
    const ContactMode mode = cluster.mode_before;
    const GuardZeros zeros(&dynamics_, cluster.x_minus, mode, trigger, rules_);
    acceleration_ = zeros.acceleration();
    const double own = zeros.At(trigger).error;
    if (zeros.SlipInSpaceEnds()) {
      const int i = guards_.ConstraintOf(trigger);
      stopped_ = StoppedTogether(system_, terms_, dynamics_.acceleration(), i, &cluster);
      cluster.guards.push_back(trigger);
      cluster.instants.push_back({i, 0, own});
    }
    const double asked = rules_.simultaneity_tolerance;
    cluster.tolerance = asked > 0 ? asked : kInstantErrors * own;
    double first = std::numeric_limits<double>::infinity(), last = -first;
    std::vector<std::pair<double, int>> order;
    const ContactMode open = ContactMode::All(system_.num_constraints()) - mode;
    for (int g : zeros.forces() | guards_.OfSlips(mode) | open) {
      const GuardZero zero = zeros.At(g);
      const double within =
          asked > 0 ? -zero.slope * asked
                    : std::min(zero.reach, -zero.slope * kInstantErrors * (own + zero.error));
      if (g != trigger && !(zero.slope < 0 && std::abs(zero.value) <= within)) continue;
      const double offset = zero.slope != 0 ? -zero.value / zero.slope : 0;
      order.emplace_back(offset, g);
      first = std::min(first, offset);
      last = std::max(last, offset);
      cluster.instants.push_back({guards_.ConstraintOf(g), offset, zero.error});
      Note(g, zero.slope);
    }
    std::sort(order.begin(), order.end());
    for (const auto& [offset, guard] : order) cluster.guards.push_back(guard);
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
          SolveFrictionalImpact(system_, cluster.x_minus.head(nq_), v_minus, touching,
                                cluster.mode_before);
      v_plus = impact.result.v_plus;
      cluster.impulse = impact.result.impulse;
      cluster.impulse_word = impact.word;
      cluster.energy_change = impact.energy_change;
      if (impact.springs) NoteSprings(touching, "impulses");
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
    contacts.slack = ForceSlack(&dynamics_, cluster);
    for (int i : touching) {
      const bool bounced = cluster.activated.Contains(i) && system_.restitution()(i) > 0;
      const double low = grazed_.Contains(i) ? Low(i) : 0;
      const double rest = std::max({Rounding(i, v_plus), bounced ? 0 : Drift(i), low});
      if (!held.Contains(i) && rate(i) > rest) continue;  // it leaves
      // A bounce too low to be seen ends with an impact, which stops slips that are no faster.
      const Friction& friction = system_.friction()[i];
      const auto slip = rate.segment(friction.row, friction.dimension);
      if (rate(i) > 0 && rate(i) <= low && slip.norm() <= rate(i)) still.Insert(i);
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

  /// A contact that rises so slowly that it is back before it has left.
  double Low(int i) const {
    const double height = kLowReaches * std::max(rules_.reach_tolerance, std::abs(terms_.gap(i)));
    return acceleration_(i) < 0 ? std::sqrt(-2 * acceleration_(i) * height) : 0;
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

  /// The motion goes on, and has no derivative.
  void NoteSprings(ContactMode contacts, const char* forces) {
    std::ostringstream message;
    message.precision(12);
    message << "at t = " << result_.transition.t << " s how contacts "
            << contacts.ToString(system_.description().constraints) << " share their " << forces
            << " decides the motion: as equal springs under them would";
    result_.transition.obstacle = {Outcome::kIndeterminateForces, message.str()};
    result_.warnings.push_back(
        {Outcome::kIndeterminateForces, result_.transition.t, message.str()});
  }

  void SetLetters(const TouchingContacts& contacts) {
    Transition& cluster = result_.transition;
    bool springs = false;
    cluster.mode_after = SelectWord(&dynamics_, cluster.x_plus, contacts, kBorder, &springs);
    if (springs) NoteSprings(contacts.still | contacts.slipping, "forces");
    const ContactMode begins = BeginInSpace(system_, contacts.still, cluster.mode_after);
    if (begins.Empty()) return Rest({});
    if (cluster.obstacle.ok()) cluster.obstacle = {Outcome::kNotPiecewiseLinear,
                        "contacts " + begins.ToString(system_.description().constraints) +
                            " begin to slip in space: derivatives across that are not offered"};
    const std::map<int, Eigen::Vector2d> directions = OnsetDirections(
        &dynamics_, cluster.x_plus, contacts, cluster.mode_after, begins, kBorder);
    Rest(directions);
    dynamics_.Evaluate(cluster.x_plus, cluster.mode_after);
    const Vector gained = terms_.jacobian * dynamics_.acceleration();
    double fastest = 0;
    for (int i : begins) {
      fastest = std::max(fastest, gained.segment<2>(system_.friction()[i].row).norm());
    }
    Rest(directions, kOnsetTime * std::max(1.0, cluster.t) * fastest);
  }

  void Rest(const std::map<int, Eigen::Vector2d>& onsets, double least = 0) {
    Vector& x = result_.transition.x_plus;
    const double size = kOnset * std::max(rules_.absolute_tolerance,
                                          kRounding * x.tail(d_).cwiseAbs().maxCoeff());
    MakeRest(system_, result_.transition.mode_after, onsets, std::max(least, size), &x);
  }

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Guards guards_;
  const TransitionRules& rules_;
  const int nq_, d_;
  ConstraintTerms terms_;
  Vector acceleration_;  // of the gaps, in the mode before [n]
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
