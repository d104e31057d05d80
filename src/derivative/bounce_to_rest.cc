// SPDX-License-Identifier: BSD-3-Clause
#include "bounce_to_rest.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/word_selection.h"

namespace contact_flow {
namespace {

/// What τ changes of the velocities; what is zero beside ε, and beside velocities.
constexpr double kBounce = 1e-8, kNone = 1e-5, kBounceRounding = 1e-13;
/// Accelerations that change by more than this part of the largest change are felt.
constexpr double kFelt = 1e-9;
/// A slip in space that begins has so many absolute tolerances.
constexpr double kOnset = 100;
/// How closely inequalities of words have to hold, relative.
constexpr double kRestBorder = 1e-9;

/// The bounce and the impact that ends it, for any time τ between its impacts.
class LastBounce {
 public:
  LastBounce(ContactDynamics* dynamics, const Transition& transition, int i, const Vector& bounce)
      : dynamics_(*dynamics),
        system_(dynamics->system()),
        x_(transition.x_plus),
        v_(x_.tail(system_.dof())),
        compliant_(transition.mode_after.Among(system_.compliant())),
        after_(transition.mode_after),
        rigid_(transition.mode_after - system_.compliant()),
        i_(i),
        bounce_(bounce) {
    Measure(x_);
    dynamics_.Evaluate(x_, after_);
    held_ = dynamics_.acceleration();
    const Vector speeds =
        v_.cwiseAbs().cwiseMax(transition.x_minus.tail(v_.size()).cwiseAbs().eval());
    for (int j : rigid_) {
      const double rounding = kBounceRounding * SlipTerms(j, speeds);
      if (!(Slip(j).norm() > rounding + kOnset * transition.absolute_tolerance)) {
        begins_.Insert(j);
      }
    }
    flight_ = Without();
    dynamics_.Evaluate(x_, flight_);
    free_ = dynamics_.acceleration();
    back_ = -(terms_.jacobian.row(i_).dot(free_) + terms_.bias(i_));
    if (!(back_ > 0)) Fail("do not come back");
    // Of what the bounce moves: another part of the system may have any speed.
    const Vector change = (free_ - held_).cwiseAbs();
    const double least = kFelt * change.maxCoeff();
    const double speed = (change.array() > least).select(speeds, 0.0).maxCoeff();
    tau_ = kBounce * (speed > 0 ? speed : speeds.maxCoeff()) / change.maxCoeff();
  }

  /// A time that is short.
  double tau() const { return tau_; }

  /// (v₂ − v⁺ − τ a)/ε.
  Vector Added(double tau) {
    const int nq = system_.num_positions(), d = system_.dof();
    const double epsilon = 0.5 * tau * back_, none = kNone * epsilon;
    Vector later(2 * d);
    later << tau * v_, epsilon * bounce_ + tau * free_;
    Vector x = system_.Perturb(x_, later);
    const FrictionalImpact impact = SolveFrictionalImpact(system_, x.head(nq), x.tail(d), rigid_,
                                                          flight_.Without(system_.compliant()));
    x.tail(d) = impact.result.v_plus;
    Measure(x);
    for (int j : rigid_) {
      if (std::abs(rate_(j)) > none) Fail("throw others up");
      if (Slip(j).norm() > none && !GoesOn(j)) Fail("make others slip anew");
    }
    return (impact.result.v_plus - v_ - tau * held_) / epsilon;
  }

 private:
  void Measure(const Vector& x) {
    const auto v = x.tail(system_.dof());
    system_.Constraints(x.head(system_.num_positions()), v, &terms_);
    rate_ = terms_.jacobian * v;
  }

  /// T v of contact j where it was measured; none without friction.
  Vector Slip(int j) const {
    const Friction& friction = system_.friction()[j];
    if (friction.coefficient == 0) return Vector();
    return rate_.segment(friction.row, friction.dimension);
  }

  /// The largest terms of T v of contact j where velocities are as large as these.
  double SlipTerms(int j, const Vector& speeds) const {
    const Friction& friction = system_.friction()[j];
    double largest = 0;
    for (int r = friction.row; Slip(j).size() > 0 && r < friction.row + friction.dimension; ++r) {
      largest = std::max(largest, terms_.jacobian.row(r).cwiseAbs().dot(speeds));
    }
    return largest;
  }

  /// The contact mode of those beside i.
  ContactMode Without() {
    TouchingContacts others;
    for (int j : rigid_.Without(i_)) {
      const bool rubs = Slip(j).size() > 0;
      if (rubs && begins_.Contains(j)) {
        others.still.Insert(j);
      } else {
        others.slipping.Set(j, rubs ? after_.LetterOf(j) : Letter::kSlip);
      }
    }
    const ContactMode flight = SelectWord(&dynamics_, x_, others, kRestBorder);
    if (flight.Members() != rigid_.Without(i_)) Fail("let others go");
    return flight.Union(compliant_);
  }

  /// Whether the slip of contact j behind the bounce is the one of the mode after.
  bool GoesOn(int j) const {
    const Letter letter = after_.LetterOf(j);
    if (letter == Letter::kStick) return false;
    if (system_.friction()[j].dimension == 2) return !begins_.Contains(j);
    return Slip(j)(0) * SlipSign(letter) > 0;
  }

  [[noreturn]] void Fail(const std::string& why) const {
    throw std::domain_error("bounces, with a little restitution, of contact '" +
                            system_.description().constraints[i_] + "' " + why);
  }

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Vector x_, v_;
  const ContactMode compliant_, after_;
  const ConstraintSet rigid_;
  const int i_;
  const Vector bounce_;
  ConstraintSet begins_;       // to slip, or sticks
  ContactMode flight_;         // without i
  Vector held_, free_;         // a, and a_f
  double back_ = 0, tau_ = 0;  // −N̈_f
  ConstraintTerms terms_;
  Vector rate_;
};

}  // namespace

Vector BounceToRest(ContactDynamics* dynamics, const Transition& transition, int i,
                    const Vector& bounce) {
  LastBounce last(dynamics, transition, i, bounce);
  // Without the order τ of the quotient.
  const Vector added = 2 * last.Added(last.tau()) - last.Added(2 * last.tau());
  const bool adds = added.cwiseAbs().maxCoeff() > kNone * bounce.cwiseAbs().maxCoeff();
  return adds ? added : Vector(Vector::Zero(bounce.size()));
}

}  // namespace contact_flow
