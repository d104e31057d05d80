// SPDX-License-Identifier: BSD-3-Clause
// Where B is linear on the cone of an order of activations: contacts that open inside the cluster
// are followed by what is known of them whatever the delays.
#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <utility>

#include "contact_flow/budget.h"
#include "contact_flow/derivative/event_map.h"
#include "frictional_event.h"

namespace contact_flow {
namespace {

constexpr int kMaxActivations = 12;
/// A gap acceleration below this part of its terms may be that of a force about to vanish.
constexpr double kNearlySame = 1e-6;
/// Contacts with a normalized G_ij below this do not feel each other's impulses.
constexpr double kCoupled = 1e-6;

}  // namespace

/// The resting contacts after the activations in S: closed; open, with a rate that is linear in w
/// and does not fall; or neither for sure (`unknown`): pushed after they had opened, or lifted or
/// not. An unknown one that is pushed until the end returns, and then the impulse on it is the same
/// in all, so that what happened meanwhile does not matter; but where it is let go again, or leaves
/// otherwise, it does.
class OrderWalk {
 public:
  explicit OrderWalk(const EventMap& map) : map_(map) {}

  struct State {
    ConstraintSet S, open, unknown;
    bool operator<(const State& o) const {
      return std::tie(S, open, unknown) < std::tie(o.S, o.open, o.unknown);
    }
  };

  /// Passes the activation of i; false with a status where that depends on what is not known.
  bool Step(int i, State* state) {
    const ImpactReset* reset = nullptr;
    const ConstraintSet closed = map_.StageAt(state->S).mode - map_.Aside();
    map_.Activate(state->S, i, &reset);
    const EventMap::Passage& passage = map_.PassageAt(state->S, closed, i);
    state->S.Insert(i);
    const ConstraintSet resting = map_.InstantAt(state->S).resting;
    state->open = (state->open - passage.struck) & resting;
    state->unknown = (state->unknown - passage.struck) | (passage.disturbed.Without(i) & resting);
    state->open = state->open - state->unknown;
    if (passage.disturbed.Contains(i)) state->open.Insert(i);
    return Look(state);
  }

  /// What the field of the stage does with them.
  bool Look(State* state) {
    const EventMap::Instant& instant = map_.InstantAt(state->S);
    const EventMap::Stage& stage = map_.StageAt(state->S);
    const ConstraintSet pushed = stage.mode & instant.resting;
    const ConstraintSet returning = pushed & state->open;
    state->open = state->open - pushed;
    state->unknown = state->unknown | returning;
    if (!state->unknown.Empty() && AreCoupled(instant.resting)) {
      state->unknown = instant.resting;
      state->open = ConstraintSet();
    }
    for (int j : state->unknown - pushed) {
      if (!instant.resting.Contains(j)) return Refuse(j, "is thrown off");
      if (LetsGo(j, instant, stage)) return Refuse(j, "is let go again");
    }
    const bool last = state->S == map_.events_;
    for (int j : state->unknown& pushed) {
      if (last && map_.system_->restitution()(j) >= 1) return Refuse(j, "bounces for ever");
    }
    for (int j : instant.resting - pushed) {
      if (!state->unknown.Contains(j) && LetsGo(j, instant, stage)) state->open.Insert(j);
    }
    return true;
  }

  /// From the start through all orders; each state once.
  bool All() {
    if (map_.num_activations() > kMaxActivations) {
      status_ = {Outcome::kTooManyPieces,
                 std::to_string(map_.num_activations()) +
                     " simultaneous activations at t = " + std::to_string(map_.transition_.t) +
                     " s: whether all selections are linear is examined for at most " +
                     std::to_string(kMaxActivations)};
      return false;
    }
    BudgetStage stage("the orders of a cluster");
    std::set<State> todo = {State()};
    std::set<State> done;
    while (!todo.empty()) {
      AskBudget();
      stage.Next();
      const State state = *todo.begin();
      todo.erase(todo.begin());
      if (!done.insert(state).second) continue;
      for (int i : map_.Remaining(state.S)) {
        State next = state;
        if (!Step(i, &next)) return false;
        if (done.count(next) == 0) todo.insert(next);
      }
    }
    return true;
  }

  const Status& status() const { return status_; }

 private:
  bool LetsGo(int j, const EventMap::Instant& instant, const EventMap::Stage& stage) const {
    return instant.rates.Along(j, stage.field) > kNearlySame * instant.rates.Terms(j, stage.field);
  }

  bool AreCoupled(ConstraintSet contacts) const {
    if (contacts.Size() < 2) return false;
    Matrix G;
    Vector unused;
    Delassus(*map_.system_, map_.transition_.x_minus, map_.dynamics_->u(), contacts, &G, &unused);
    const Vector scale = G.diagonal().cwiseSqrt().cwiseInverse();
    G = scale.asDiagonal() * G * scale.asDiagonal();
    return (G - Matrix::Identity(G.rows(), G.cols())).cwiseAbs().maxCoeff() > kCoupled;
  }

  bool Refuse(int j, const char* what) {
    std::ostringstream message;
    message << "at t = " << map_.transition_.t << " s the contact '"
            << map_.system_->description().constraints[j]
            << "' may open and return inside a cluster, and then " << what
            << ": the outcome depends on whether it had returned, and is not piecewise linear in "
               "the direction; single directions have their derivative";
    status_ = {Outcome::kNotDifferentiable, message.str()};
    return false;
  }

  const EventMap& map_;
  Status status_;
};

Status EventMap::PiecewiseLinear(const std::vector<int>& order) const {
  if (!status_.ok() || friction_ || absorbed_) return status_;
  OrderWalk walk(*this);
  OrderWalk::State state;
  for (int i : order) {
    if (!walk.Step(i, &state)) break;
  }
  return walk.status();
}

Matrix EventMap::AnySelection() const {
  if (friction_) return AnyPath().matrix;
  if (activated_.empty() || !PiecewiseLinear(activated_).ok()) {
    return Matrix::Identity(width(), width());
  }
  return Selection(activated_);
}

const Status& EventMap::PiecewiseLinear() const {
  if (friction_) return status_;
  if (examined_) return piecewise_linear_;
  OrderWalk walk(*this);
  if (status_.ok()) walk.All();
  piecewise_linear_ = status_.ok() ? walk.status() : status_;
  examined_ = true;
  return piecewise_linear_;
}

}  // namespace contact_flow
