// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/flow/transition.h"
#include "src/dynamics/mode_selection.h"

namespace contact_flow {

/// Of a rate Da_i v, relative to Σ_k |∂a_i/∂q_k v_k|; of a gap, relative to the coordinates.
inline constexpr double kRounding = 1e-12;
/// What a gap is known to where nothing but rounding disturbs it, relative to the coordinates.
inline constexpr double kUnits = 1e-14;
/// A contact that rises to less than this many reaches cannot be told from one that rests.
inline constexpr double kLowReaches = 4;
/// One that rises to less than this part of it rests: its way up is lost in rounding.
inline constexpr double kNoReach = 1e-3;
/// Speeds that were made rest are worth a warning above this part of the speed tolerance.
inline constexpr double kNotable = 1e-2;
inline constexpr double kAboveDrift = 10;
/// Errors of single steps, each within the tolerances, grow to this many tolerances. A guard that
/// is some of those further from zero does not vanish now, however little is known of instants:
/// events that only might coincide keep their order, and its doubt is the derivative's.
inline constexpr double kAccumulated = 1e3;
/// Beyond its own error, a gap that vanishes with another is this many tolerances above zero at
/// most: its contact is hit there. Of two touchdowns the instant of a slow one may be known little,
/// and a fast one be high above its surface all that time.
inline constexpr double kHitAbove = 1;
/// A gap that closes by less than this part of the tolerances, and opens, is not known to close.
inline constexpr double kUnknownDip = 1e-2;

/// What integration leaves of a slip, by a row of T of this norm at velocities of this norm, but no
/// more than what counts as rest: it is not told from none. Of options, or rules.
template <class Tolerances>
double UnresolvedSlip(const Tolerances& by, double row, double speed) {
  return std::min((by.absolute_tolerance + by.relative_tolerance * speed) * row,
                  by.speed_tolerance);
}

/// Resolves one cluster, in the order of its methods.
class Resolution {
 public:
  Resolution(ContactDynamics* dynamics, double t, const Vector& x, ContactMode mode,
             const TransitionRules& rules)
      : dynamics_(*dynamics),
        system_(dynamics->system()),
        rules_(rules),
        nq_(system_.num_positions()),
        d_(system_.dof()),
        compliant_(system_.compliant()) {
    result_.approach_speed = result_.release_rate = std::numeric_limits<double>::infinity();
    transition().t = t;
    transition().x_minus = transition().x_plus = x;
    transition().mode_before = transition().mode_after = mode;
    transition().impulse = Vector::Zero(system_.num_rows());
    transition().impact_law = rules.impact_law;
    transition().relative_tolerance = rules.relative_tolerance;
    transition().absolute_tolerance = rules.absolute_tolerance;
    system_.Constraints(x.head(nq_), x.tail(d_), &terms_);
    rate_ = terms_.jacobian * x.tail(d_);
    force_rate_ = dynamics_.ForceRate(x, mode);
    force_ = dynamics_.force();
    acceleration_ = terms_.jacobian * dynamics_.acceleration() + terms_.bias;
    FindGuardErrors(x.head(nq_));
  }

  void Collect(int trigger);
  void Decide();
  ResolvedTransition Take() { return std::move(result_); }

 private:
  Transition& transition() { return result_.transition; }
  /// Whether its guard is the force.
  bool IsMember(int i) const { return (result_.transition.mode_before - compliant_).Contains(i); }
  GuardJet GuardOf(int i) const {
    if (IsMember(i)) return {force_(i), force_rate_(i)};
    const double sign = Guards::GapSign(i, result_.transition.mode_before);
    return {sign * terms_.gap(i), sign * rate_(i), sign * acceleration_(i)};
  }
  const std::string& Name(int i) const { return system_.description().constraints[i]; }

  /// What a rate Da_i v is known to.
  double Rounding(int i, const Vector& v) const {
    return kRounding * terms_.jacobian.row(i).cwiseAbs().dot(v.cwiseAbs());
  }
  /// The speed below which constraint i stands still: with it, it reaches less than the tolerance
  /// before its acceleration turns it.
  double Still(int i, const Vector& v, double acceleration) const {
    const double unresolved = std::sqrt(2 * std::abs(acceleration) * rules_.reach_tolerance);
    return std::max(std::isfinite(unresolved) ? std::min(rules_.speed_tolerance, unresolved)
                                              : rules_.speed_tolerance,
                    Rounding(i, v));
  }
  double Still(int i) const {
    return Still(i, result_.transition.x_minus.tail(d_), acceleration_(i));
  }
  /// The speed of a contact that lifts off and is pressed back, too low to be resolved.
  double Low(int i) const {
    const double reach = kLowReaches * std::max(rules_.reach_tolerance, std::abs(terms_.gap(i)));
    return acceleration_(i) < 0 ? std::sqrt(-2 * acceleration_(i) * reach) : 0;
  }
  void FindGuardErrors(const VectorRef& q);
  /// How much later than the trigger, whose instant has an error, event i still counts as
  /// simultaneous [s].
  double Within(int i, double slope, double trigger_error) const {
    const double asked = rules_.simultaneity_tolerance;
    return asked > 0 ? asked : kInstantErrors * (trigger_error + InstantError(i, slope));
  }
  /// Whether guard i, which falls with this slope, vanishes together with the trigger.
  bool FallsWith(int i, double value, double slope, double trigger_error) const {
    const double beyond = IsMember(i) ? 1 : kHitAbove / kAccumulated;
    const double far = rules_.simultaneity_tolerance > 0
                           ? std::numeric_limits<double>::infinity()
                           : kInstantErrors * std::min(guard_error_(i), guard_reach_(i)) +
                                 beyond * guard_reach_(i);
    return value <= std::min(far, Within(i, slope, trigger_error) * -slope);
  }
  /// Estimated error of the instant at which guard i, of this slope, vanishes [s]; a gap that
  /// grazes is turned by its acceleration ä: δt ≤ min(δa/|ȧ|, √(2 δa/|ä|)).
  double InstantError(int i, double slope) const {
    const double error = guard_error_(i);
    const double steep = slope != 0 ? error / std::abs(slope) : 0;
    if (IsMember(i) || acceleration_(i) == 0) return steep;
    const double turned = std::sqrt(2 * error / std::abs(acceleration_(i)));
    return slope != 0 ? std::min(steep, turned) : turned;
  }
  void Touch(int i, double slope);
  void NoteUnresolvedDip(int i, double slope);
  bool HasLetGo(int i, double rate) const;
  void Warn(Outcome code, const std::string& message) {
    result_.warnings.push_back({code, result_.transition.t, message});
  }
  std::string Sentence(const std::string& what) const;

  ForceTolerance WhatVanishes() const;
  ConstraintSet Resting(const Vector& v_plus, ConstraintSet hit, ConstraintSet touching);
  void Release(ConstraintSet rigid);
  void Settle(const Vector& v_plus, ConstraintSet hit, ConstraintSet resting,
              const InverseInertia* inertia);
  void Hold(const Vector& v_plus, ConstraintSet hit, ConstraintSet held);
  bool TurnsBack(const Vector& v_plus, ConstraintSet hit) const;
  void WarnOfTouching(ConstraintSet hit);

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const TransitionRules& rules_;
  const int nq_, d_;
  const ConstraintSet compliant_;
  ConstraintTerms terms_;
  Vector rate_, acceleration_, force_, force_rate_;
  Vector far_;              // how large coordinates are, along tangents [d]
  Vector guard_error_;      // of gaps [m] and of members' forces [N], as far as it is estimated [n]
  Vector guard_reach_;      // what tolerances may grow to in them [n]
  ConstraintSet touching_;  // a_i = ȧ_i = 0 beyond J⁻ and the cluster
  ConstraintSet pressed_;
  ConstraintSet doubtful_;  // that rest though they rise, by an acceleration that brings them back
  ResolvedTransition result_;
};

}  // namespace contact_flow
