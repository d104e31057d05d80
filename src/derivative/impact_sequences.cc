// SPDX-License-Identifier: BSD-3-Clause
#include "impact_sequences.h"

#include <algorithm>
#include <cmath>

#include "contact_flow/budget.h"
#include "src/dynamics/mode_selection.h"

namespace contact_flow {
namespace {

/// Accelerations of a gap below this part of the largest are zero.
constexpr double kStill = 1e-9;
/// At most this many contacts are followed both ways at a stage.
constexpr int kMaxDoubtful = 3;
/// Impacts in all, for each order that may be listed.
constexpr long kVisitsPerOrder = 20;

}  // namespace

ImpactSequences::ImpactSequences(ContactDynamics* dynamics, const Transition& transition,
                                 const TouchingFrame& frame, SequenceRules rules)
    : dynamics_(*dynamics),
      system_(dynamics->system()),
      transition_(transition),
      frame_(frame),
      rules_(std::move(rules)),
      q_(transition.x_minus.head(system_.num_positions())),
      pressed_(transition.mode_after & system_.compliant()),
      longest_(kMaxImpactsPerActivation * (transition.activated |
                                           (transition.touching - rules_.shut) |
                                           (transition.vanishing & frame.touching))
                                              .Size()) {
  path_.impulse = Vector::Zero(system_.num_rows());
  const State begin = {transition.x_minus.tail(system_.dof()),
                       (transition.mode_before | rules_.shut) & frame.touching, ConstraintSet()};
  for (const State& state : Branches(begin, transition.vanishing & begin.resting)) {
    Visit(state, false);
  }
}

Vector ImpactSequences::StateAt(const Vector& v) const {
  Vector x(q_.size() + v.size());
  x << q_, v;
  return x;
}

/// The states with each subset of the doubtful contacts at rest, the others ajar.
std::vector<ImpactSequences::State> ImpactSequences::Branches(const State& state,
                                                              ConstraintSet doubtful) const {
  std::vector<State> branches = {state};
  for (int i : doubtful) {
    const std::size_t count = branches.size();
    for (std::size_t k = 0; k < count; ++k) {
      State other = branches[k];
      branches[k].resting.Insert(i);
      branches[k].ajar.Erase(i);
      other.resting.Erase(i);
      other.ajar.Insert(i);
      branches.push_back(other);
    }
  }
  return branches;
}

/// What may rest or be ajar when the next impact comes.
std::vector<ImpactSequences::State> ImpactSequences::AfterAWhile(const State& state) {
  const ConstraintSet touching = state.resting | state.ajar;
  if (touching.Empty()) return {state};
  const Vector x = StateAt(state.v);
  const ContactMode mode = SelectContactMode(&dynamics_, x, touching, {}, pressed_);
  dynamics_.Evaluate(x, mode);
  ConstraintTerms terms;
  system_.Constraints(q_, state.v, &terms);
  const Vector opening = terms.jacobian * dynamics_.acceleration() + terms.bias;
  const double still = kStill * (terms.jacobian.cwiseAbs() * dynamics_.acceleration().cwiseAbs() +
                                 terms.bias.cwiseAbs())
                                    .maxCoeff();
  State next = state;
  ConstraintSet doubtful;
  for (int i : touching) {
    const bool holds = mode.Contains(i), opens = !holds && opening(i) > still;
    if (opens) {
      next.resting.Erase(i);
      next.ajar.Insert(i);
    } else if (state.ajar.Contains(i) || !holds) {
      doubtful.Insert(i);
    }
  }
  if (doubtful.Size() > kMaxDoubtful) {
    all = false;
    doubtful = ConstraintSet();
  }
  return Branches(next, doubtful);
}

void ImpactSequences::Visit(const State& state, bool later) {
  AskBudget();
  if (outcomes.size() >= rules_.max_orders ||
      ++visits_ > kVisitsPerOrder * static_cast<long>(rules_.max_orders)) {
    all = false;
    return;
  }
  ConstraintSet urgent, approaching;
  for (int i : frame_.touching - state.resting) {
    if (Rate(i, state.v) >= -Rest(i)) continue;
    (state.ajar.Contains(i) ? urgent : approaching).Insert(i);
  }
  if ((urgent | approaching).Empty()) return Finish(state, false);
  if (static_cast<int>(path_.order.size()) >= longest_) return Finish(state, true);
  if (!urgent.Empty() || !later) {
    for (int i : urgent.Empty() ? approaching : urgent) Hit(state, i);
    return;
  }
  for (const State& waited : AfterAWhile(state)) {
    for (int i : approaching) Hit(waited, i);
  }
}

void ImpactSequences::Hit(const State& state, int i) {
  for (int j : state.ajar.Without(i)) ajar.Insert(j);
  const ImpactResult impact = frame_.Impact(state.v, state.resting.With(i));
  path_.order.push_back(i);
  path_.impulse += impact.impulse;
  const State after = After(state, i, impact);
  RecordStage(after);
  try {
    RecordDegenerate(state, after, i, impact);
    Visit(after, true);
  } catch (const UndecidedMode& reason) {
    all = simple = false;  // no one mode fits between two impacts: this order ends here
    outcomes.push_back(path_);
    outcomes.back().v_plus = after.v;
    outcomes.back().status = {Outcome::kFilippov, reason.what()};
    resting.push_back(after.resting | after.ajar);
  }
  path_.impulse -= impact.impulse;
  path_.order.pop_back();
}

ImpactSequences::State ImpactSequences::After(const State& state, int i,
                                              const ImpactResult& impact) const {
  State after = {impact.v_plus, ConstraintSet(), state.ajar.Without(i)};
  for (int j : state.resting) {
    if (std::abs(Rate(j, impact.v_plus)) <= Rest(j)) after.resting.Insert(j);
  }
  if (frame_.Restitution(i) == 0) after.resting.Insert(i);
  for (int j : state.ajar.Without(i)) {
    if (Rate(j, impact.v_plus) > Rest(j)) after.ajar.Erase(j);
  }
  return after;
}

void ImpactSequences::RecordDegenerate(const State& before, const State& after, int i,
                                       const ImpactResult& impact) {
  ConstraintSet held, doubtful;
  for (int j : before.resting) {
    const double push = impact.impulse(j) * frame_.G(frame_.Row(j), frame_.Row(j));
    if (std::abs(push) > Rest(j)) {
      held.Insert(j);
    } else if (after.resting.Contains(j) && frame_.law == ImpactLaw::kComplementarity) {
      doubtful.Insert(j);
    }
  }
  for (int j : before.ajar& after.ajar) {
    if (std::abs(Rate(j, impact.v_plus)) <= Rest(j)) doubtful.Insert(j);
  }
  if (doubtful.Empty()) return;
  const Vector x = StateAt(after.v);
  const ContactMode mode =
      SelectContactMode(&dynamics_, x, after.resting | after.ajar, {}, pressed_);
  dynamics_.Evaluate(x, mode);
  const Vector force = dynamics_.force();
  for (int j : doubtful) {
    if (mode.Contains(j) && force(j) > kStill * force.cwiseAbs().maxCoeff()) continue;
    const bool known = std::any_of(degenerate.begin(), degenerate.end(), [&](const auto& other) {
      return other.constraint == j && other.hit == i && other.held == held;
    });
    if (!known) degenerate.push_back({j, i, held, before.v});
  }
}

/// Stages are those of orders in which each constraint of I_a has been hit at most once.
void ImpactSequences::RecordStage(const State& state) {
  ConstraintSet S;
  for (int i : path_.order) S.Insert(i);
  if (S.Size() != static_cast<int>(path_.order.size()) || !(S - transition_.activated).Empty()) {
    simple = false;
    return;
  }
  const auto [known, is_new] = stages_.insert({S, state});
  if (is_new) return;
  staged = staged && rules_.same(known->second.v, state.v) &&
           (known->second.resting | known->second.ajar) == (state.resting | state.ajar);
}

void ImpactSequences::Finish(const State& state, bool cut) {
  OrderOutcome outcome = path_;
  outcome.v_plus = state.v;
  const ConstraintSet rest = state.resting | state.ajar;
  outcome.mode_after = ContactMode(rest | pressed_);
  if (cut) {
    outcome.status = {Outcome::kZeno, "after " + std::to_string(longest_) +
                                          " impacts contacts still approach: the order was cut"};
    simple = false;
  } else {
    try {
      outcome.mode_after = SelectContactMode(&dynamics_, StateAt(state.v), rest, {}, pressed_);
    } catch (const UndecidedMode& reason) {
      outcome.status = {Outcome::kFilippov, reason.what()};
    }
    if (path_.order.size() != static_cast<std::size_t>(transition_.activated.Size())) {
      simple = false;
    }
  }
  // The branches of one order often end together.
  std::vector<std::size_t>& ends = found_[outcome.order];
  for (std::size_t k : ends) {
    if (outcomes[k].mode_after == outcome.mode_after && resting[k] == rest &&
        outcomes[k].status.outcome == outcome.status.outcome &&
        rules_.same(outcomes[k].v_plus, outcome.v_plus)) {
      return;
    }
  }
  ends.push_back(outcomes.size());
  outcomes.push_back(outcome);
  resting.push_back(rest);
}

}  // namespace contact_flow
