// SPDX-License-Identifier: BSD-3-Clause
#include "settled_together.h"

#include <cmath>
#include <sstream>

#include "contact_flow/model/driven.h"
#include "frictional_resolution.h"
#include "guarded.h"
#include "src/dynamics/implied_contacts.h"

namespace contact_flow {
namespace {

/// Speeds up to so many times what is not told from rest are taken for it, the slowest first.
constexpr double kTakenForRest = 100;

}  // namespace

/// First where what is made rest sticks, and all forces fit; else by the letters of its forces.
bool FrictionalResolution::SettleTogether(Outcome outcome, const std::string& why) {
  const ResolvedTransition begun = result_;
  for (const bool stuck : {true, false}) {
    for (double limit = Unresolved(); limit <= kTakenForRest * Unresolved(); limit *= 10) {
      result_ = begun;
      try {
        if (!RestSlow(limit, stuck)) continue;
      } catch (const FrictionRefusal&) {
        continue;
      }
      TellOfSettling(outcome, why, limit);
      return true;
    }
  }
  result_ = begun;
  return false;
}

void FrictionalResolution::TellOfSettling(Outcome outcome, const std::string& why, double limit) {
  Transition& cluster = result_.transition;
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << cluster.t << " s " << why << ": speeds of contacts "
          << cluster.mode_after.ToString(system_.description().constraints) << " up to " << limit
          << " m/s are taken to rest, which changes the kinetic energy by " << -cluster.energy_lost
          << " J";
  cluster.obstacle = {outcome, message.str()};
  result_.warnings.push_back({outcome, cluster.t, message.str()});
}

/// What touches, and neither rises nor slips faster than `limit` [m/s], comes to rest.
bool FrictionalResolution::RestSlow(double limit, bool stuck) {
  Transition& cluster = result_.transition;
  const Vector v = cluster.x_minus.tail(d_);
  const ConstraintSet before = cluster.mode_before;
  ConstraintSet still;
  TouchingContacts contacts;
  for (int i = 0; i < system_.num_constraints(); ++i) {
    const bool rigid = !system_.compliant().Contains(i);
    const bool touches = rigid && std::abs(terms_.gap(i)) <= rules_.gap_tolerance;
    if (!before.Contains(i) && !(touches && rate_(i) <= limit)) continue;
    if (rigid && rate_(i) < -limit) return false;
    if (!before.Contains(i) && rate_(i) < -Rounding(i, v)) cluster.activated.Insert(i);
    const Friction& friction = system_.friction()[i];
    if (rate_.segment(friction.row, friction.dimension).norm() <= limit) still.Insert(i);
    Sort(i, rate_, v, still, &contacts);
  }
  ContactMode word = contacts.slipping;
  for (int i : contacts.still) word.Set(i, Letter::kStick);
  cluster.touching = word - before - cluster.activated;
  MakeRest(system_, word.Without(system_.compliant()), {}, &cluster.x_plus);
  if (!cluster.x_plus.allFinite()) return false;
  const InverseInertia inertia(system_, cluster.x_plus.head(nq_), v);
  cluster.energy_lost =
      KineticEnergy(inertia.mass(), v) - KineticEnergy(inertia.mass(), cluster.x_plus.tail(d_));
  if (!stuck) {
    SetLetters(contacts);
    return true;
  }
  cluster.mode_after = word;
  return ForcesFit(cluster.x_plus, word);
}

std::optional<ResolvedTransition> ResolveBySettling(ContactDynamics* dynamics, double t,
                                                    const Vector& x, ContactMode mode,
                                                    const TransitionRules& rules, Outcome outcome,
                                                    const std::string& why) {
  FrictionalResolution resolution(dynamics, t, x, mode, rules);
  bool settled = false;
  const Status status = Guarded(t, [&] { settled = resolution.SettleTogether(outcome, why); });
  if (!settled || !status.ok()) return std::nullopt;
  ResolvedTransition result = resolution.Take();
  result.status = status;
  result.transition.released = mode - result.transition.mode_after;
  return result;
}

}  // namespace contact_flow
