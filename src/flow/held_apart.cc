// SPDX-License-Identifier: BSD-3-Clause
// Contacts that stick on dependent rows which the motion moves apart.
#include "held_apart.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "contact_flow/flow/flow.h"
#include "contact_flow/flow/manifold_projection.h"
#include "frictional_resolution.h"
#include "guarded.h"
#include "step_constants.h"

namespace contact_flow {
namespace {

/// Rows that are nearly dependent have this part of what they are alone, and a change of v that no
/// error of integration explains is this many of its tolerances.
constexpr double kAmplified = 1e4, kUnexplained = 1e3;
/// Rates that are left of a row beyond this part of the largest make it one of those apart.
constexpr double kPartApart = 1e-3;
/// Where accelerations still agree, to what is known of them, rates may grow by this factor a time,
/// and by so much in all.
constexpr double kReachGrowth = 4, kMostReach = 100;

std::string ApartSentence(const MechanicalSystem& system, double t, ConstraintSet apart,
                          const char* what) {
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << t << " s contacts " << apart.ToString(system.description().constraints)
          << " stick on rows that depend on each other, and are moved apart: no velocity holds all "
             "of them"
          << what;
  return message.str();
}

}  // namespace

/// What is left of rates that the mode holds at the end of the step, or what would have to be taken
/// from the velocity to hold them, in what may be; fills apart_ where that is above 1.
double Flow::HeldMisfit() {
  apart_ = ConstraintSet();
  if (!system_.HasFriction() || !Drifts(stepper_->end(), gaps_end_)) return 0;
  const Vector& x = stepper_->end();
  const HeldRates held = RatesOfHeld(system_, mode_, x);
  const double largest = held.left.lpNorm<Eigen::Infinity>();
  double misfit = largest / (held_reach_ * SlowDrift());
  Vector rates = held.left;
  if (held.amplified > kAmplified) {
    const double known = options_.absolute_tolerance +
                         options_.relative_tolerance * x.tail(system_.dof()).cwiseAbs().maxCoeff();
    const double change = held.change.lpNorm<Eigen::Infinity>();
    misfit = std::max(misfit, change / (kUnexplained * known));
    for (std::size_t r = 0; r < held.rows.size(); ++r) {
      rates(static_cast<Eigen::Index>(r)) = gaps_end_.rate(held.rows[r]);
    }
  }
  if (!(misfit > 1)) return misfit;
  const double part = kPartApart * rates.lpNorm<Eigen::Infinity>();
  for (std::size_t r = 0; r < held.rows.size(); ++r) {
    if (!(std::abs(rates(static_cast<Eigen::Index>(r))) > part)) continue;
    for (int i : mode_ - system_.compliant()) {
      const Friction& friction = system_.friction()[i];
      const int row = held.rows[r];
      const bool own = row >= friction.row && row < friction.row + friction.dimension;
      if (row == i || own) apart_.Insert(i);
    }
  }
  return misfit;
}

/// The guard of one of apart_, where the proposal has to end for them, or −1.
int Flow::HeldApart() {
  if (!(misfit_ > 1) || apart_.Empty()) {
    apart_ = ConstraintSet();
    return -1;
  }
  const int i = *apart_.begin();
  return system_.friction()[i].dimension > 0 ? guards_.OfFriction(i) : i;
}

/// False where apart_ are to hold on, as no other word follows: the run goes on, or ends.
bool Flow::TakesOtherWord(const ResolvedTransition& resolved) {
  if (apart_.Empty() || resolved.transition.mode_after != mode_) {
    held_reach_ = 1;
    return true;
  }
  held_reach_ *= kReachGrowth;
  if (held_reach_ > kMostReach) {
    status_ = {Outcome::kIndeterminateForces,
               ApartSentence(system_, t_, apart_, ", and no other word was found")};
  }
  return false;
}

ResolvedTransition ResolveHeldApart(ContactDynamics* dynamics, double t, const Vector& x,
                                    ContactMode mode, ConstraintSet apart,
                                    const TransitionRules& rules) {
  const MechanicalSystem& system = dynamics->system();
  FrictionalResolution resolution(dynamics, t, x, mode, rules);
  const Status status = Guarded(t, [&] { resolution.DecideInput(); });
  ResolvedTransition result = resolution.Take();
  result.status = status;
  if (!status.ok()) {
    result.status.message = ApartSentence(system, t, apart, "; ") + status.message;
    return result;
  }
  Transition& transition = result.transition;
  transition.released = mode - transition.mode_after;
  const Guards guards(system);
  for (int i : mode.Sticking()) {
    if (transition.mode_after.LetterOf(i) == Letter::kStick) continue;
    transition.guards.push_back(guards.OfFriction(i));
  }
  transition.obstacle = {
      Outcome::kNotPiecewiseLinear,
      ApartSentence(system, t, apart, ": derivatives across that are not offered")};
  return result;
}

}  // namespace contact_flow
