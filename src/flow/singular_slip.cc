// SPDX-License-Identifier: BSD-3-Clause
#include "singular_slip.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "frictional_resolution.h"
#include "guarded.h"
#include "src/dynamics/tangential_impact.h"

namespace contact_flow {
namespace {

/// What slips with friction, the largest force first.
std::vector<int> Slips(ContactDynamics* dynamics, const Vector& x, ContactMode mode) {
  dynamics->Evaluate(x, mode);
  const MechanicalSystem& system = dynamics->system();
  std::vector<int> slips;
  for (int i : mode - mode.Sticking()) {
    if (system.friction()[i].dimension > 0 && system.friction()[i].coefficient > 0) {
      slips.push_back(i);
    }
  }
  const Vector force = dynamics->force().cwiseAbs();
  std::stable_sort(slips.begin(), slips.end(), [&](int a, int b) { return force(a) > force(b); });
  return slips;
}

/// The transition that `decide` makes of it; nothing where that fails.
template <class Decide>
std::optional<ResolvedTransition> Try(ContactDynamics* dynamics, double t, const Vector& x,
                                      ContactMode mode, const TransitionRules& rules,
                                      const Decide& decide) {
  FrictionalResolution resolution(dynamics, t, x, mode, rules);
  bool possible = false;
  const Status status = Guarded(t, [&] { possible = decide(&resolution); });
  if (!possible || !status.ok()) return std::nullopt;
  ResolvedTransition result = resolution.Take();
  result.status = status;
  result.transition.released = mode - result.transition.mode_after;
  return result;
}

/// The same of the first of `slips` that it succeeds for.
std::optional<ResolvedTransition> TryEach(ContactDynamics* dynamics, double t, const Vector& x,
                                          ContactMode mode, const TransitionRules& rules,
                                          const std::vector<int>& slips,
                                          bool (FrictionalResolution::*decide)(int)) {
  for (int i : slips) {
    auto found = Try(dynamics, t, x, mode, rules,
                     [&](FrictionalResolution* resolution) { return (resolution->*decide)(i); });
    if (found) return found;
  }
  return std::nullopt;
}

}  // namespace

void FrictionalResolution::TellOfSingularSlip(int i, Outcome outcome, const std::string& what) {
  std::ostringstream message;
  message.precision(12);
  const bool crossing = outcome == Outcome::kPainleveCrossing;
  message << "at t = " << result_.transition.t << " s "
          << (crossing ? "the slip of contact '" : "no forces exist beside the slip of contact '")
          << system_.description().constraints[i]
          << (crossing ? "' becomes singular (Painleve): " : "' (Painleve): ") << what;
  result_.transition.obstacle = {outcome, message.str()};
  result_.warnings.push_back({outcome, result_.transition.t, message.str()});
}

/// From the state that the transition has reached so far, in which contacts have these letters.
bool FrictionalResolution::EndSlip(int jammed, ContactMode word) {
  Transition& cluster = result_.transition;
  const std::optional<FrictionalImpact> impact = SolveTangentialImpact(
      system_, cluster.x_plus.head(nq_), cluster.x_plus.tail(d_), word, jammed);
  if (!impact) return false;
  const Vector v_plus = impact->result.v_plus;
  cluster.x_plus.tail(d_) = v_plus;
  cluster.impulse += impact->result.impulse;
  cluster.impulse_word = cluster.impulse_word.Union(impact->word);
  cluster.energy_change += impact->energy_change;
  const Vector rate = terms_.jacobian * v_plus;
  TouchingContacts contacts;
  for (int i : impact->word) Sort(i, rate, v_plus, impact->word.Sticking(), &contacts);
  SetLetters(contacts);
  return true;
}

/// Letters; where no forces exist, after an impact without collision that ends a slip.
void FrictionalResolution::SetLettersOrEndSlip(const TouchingContacts& contacts) {
  const Transition before = result_.transition;
  try {
    return SetLetters(contacts);
  } catch (const FrictionRefusal& reason) {
    const bool none = reason.kind == FrictionRefusal::Kind::kInconsistent ||
                      reason.kind == FrictionRefusal::Kind::kIndeterminateForces;
    if (!none) throw;
    ContactMode word = contacts.slipping;
    for (int i : contacts.still) word.Set(i, Letter::kStick);
    for (int i : contacts.slipping) {
      const Friction& friction = system_.friction()[i];
      if (friction.dimension == 0 || !(friction.coefficient > 0)) continue;
      result_.transition = before;
      bool ended = false;
      try {
        ended = EndSlip(i, word);
      } catch (const FrictionRefusal&) {
      }
      if (!ended) continue;
      std::ostringstream what;
      what << "an impact without collision ends it, energy changes by "
           << result_.transition.energy_change << " J";
      return TellOfSingularSlip(i, Outcome::kPainleveInconsistent, what.str());
    }
    result_.transition = before;
    if (!RestSlowSlips(contacts)) throw;
  }
}

/// Slips that are not told from none count as none, where they would leave no forces.
bool FrictionalResolution::RestSlowSlips(const TouchingContacts& contacts) {
  const Vector v = result_.transition.x_plus.tail(d_);
  const Vector rate = terms_.jacobian * v;
  TouchingContacts rested = contacts;
  int slow = -1;
  for (int i : contacts.slipping) {
    const Friction& friction = system_.friction()[i];
    if (friction.dimension == 0 || !(friction.coefficient > 0)) continue;
    const double size = terms_.jacobian.row(friction.row).norm();
    const double slip = rate.segment(friction.row, friction.dimension).norm();
    if (slip > UnresolvedSlip(rules_, size, v.norm())) continue;
    rested.slipping.Erase(i);
    rested.still.Insert(i);
    slow = i;
  }
  if (slow < 0) return false;
  try {
    SetLetters(rested);
  } catch (const FrictionRefusal&) {
    return false;
  }
  TellOfSingularSlip(slow, Outcome::kPainleveInconsistent,
                     "it is slower than what is resolved, and taken to rest");
  return true;
}

bool FrictionalResolution::LetGo(int i) {
  Transition& cluster = result_.transition;
  const Vector v = cluster.x_minus.tail(d_);
  TouchingContacts contacts;
  for (int j : cluster.mode_before.Without(i)) {
    Sort(j, rate_, v, cluster.mode_before.Sticking(), &contacts);
  }
  SetLetters(contacts);
  dynamics_.Evaluate(cluster.x_plus, cluster.mode_after);
  const double rise = terms_.jacobian.row(i).dot(dynamics_.acceleration()) + terms_.bias(i);
  if (!(rise > 0)) return false;
  TellOfSingularSlip(i, Outcome::kPainleveCrossing,
                     "from here on it may go on, jam, or let go, as it does");
  return true;
}

bool FrictionalResolution::Settle(int i) {
  Transition& cluster = result_.transition;
  const Vector v = cluster.x_minus.tail(d_);
  const Friction& friction = system_.friction()[i];
  const double slip = rate_.segment(friction.row, friction.dimension).norm();
  if (!(slip <= Unresolved())) return false;
  TouchingContacts contacts;
  const ConstraintSet still = cluster.mode_before.Sticking().With(i);
  for (int j : cluster.mode_before) Sort(j, rate_, v, still, &contacts);
  SetLetters(contacts);
  if (cluster.mode_after.LetterOf(i) != Letter::kStick) return false;
  std::ostringstream what;
  what << "it sticks, having slipped by no more than " << slip << " m/s";
  TellOfSingularSlip(i, Outcome::kPainleveCrossing, what.str());
  return true;
}

bool FrictionalResolution::ChooseAgain(int i) {
  const Transition& cluster = result_.transition;
  TouchingContacts contacts;
  for (int j : cluster.mode_before) {
    Sort(j, rate_, cluster.x_minus.tail(d_), cluster.mode_before.Sticking(), &contacts);
  }
  SetLetters(contacts);
  if (cluster.mode_after == cluster.mode_before) return false;
  TellOfSingularSlip(i, Outcome::kPainleveCrossing,
                     "forces beside it pass their bounds too quickly to be resolved");
  return true;
}

std::optional<ResolvedTransition> ResolveJam(ContactDynamics* dynamics, double t, const Vector& x,
                                             ContactMode mode, const TransitionRules& rules) {
  for (int i : Slips(dynamics, x, mode)) {
    auto jam = Try(dynamics, t, x, mode, rules, [i](FrictionalResolution* r) {
      if (!r->EndSlip(i)) return false;
      r->TellOfSingularSlip(i, Outcome::kPainleveCrossing, "an impact without collision ends it");
      return true;
    });
    if (jam) return jam;
  }
  return std::nullopt;
}

std::optional<ResolvedTransition> ResolveUnresolvedSlip(ContactDynamics* dynamics, double t,
                                                        const Vector& x, ContactMode mode,
                                                        const TransitionRules& rules) {
  if (auto jam = ResolveJam(dynamics, t, x, mode, rules)) return jam;
  const std::vector<int> slips = Slips(dynamics, x, mode);
  std::vector<int> pulled = slips;
  const Vector force = dynamics->force();
  pulled.erase(std::remove_if(pulled.begin(), pulled.end(), [&](int i) { return !(force(i) < 0); }),
               pulled.end());
  if (auto open = TryEach(dynamics, t, x, mode, rules, pulled, &FrictionalResolution::LetGo)) {
    return open;
  }
  for (const auto decide : {&FrictionalResolution::Settle, &FrictionalResolution::ChooseAgain}) {
    if (auto found = TryEach(dynamics, t, x, mode, rules, slips, decide)) return found;
  }
  return std::nullopt;
}

ResolvedTransition ResolveSingularSlip(ContactDynamics* dynamics, double t, const Vector& x,
                                       ContactMode mode, const TransitionRules& rules) {
  if (auto jam = ResolveJam(dynamics, t, x, mode, rules)) return *jam;
  const std::vector<int> slips = Slips(dynamics, x, mode);
  for (const auto decide : {&FrictionalResolution::LetGo, &FrictionalResolution::Settle}) {
    if (auto found = TryEach(dynamics, t, x, mode, rules, slips, decide)) return *found;
  }
  FrictionalResolution resolution(dynamics, t, x, mode, rules);
  if (!slips.empty()) {
    resolution.TellOfSingularSlip(slips.front(), Outcome::kPainleveCrossing,
                                  "it neither lets go nor ends by an impact");
  }
  ResolvedTransition result = resolution.Take();
  result.status = result.transition.obstacle;
  return result;
}

}  // namespace contact_flow
