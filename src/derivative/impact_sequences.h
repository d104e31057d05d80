// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/derivative/order_outcomes.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "touching_frame.h"

namespace contact_flow {

/// A contact at rest that an impact neither pushes nor lifts, 0 = p ⟂ w = 0, and that is not
/// pressed after it. (One that is pressed may be lifted by O(|w|) and falls back within a time
/// O(|w|): to first order the same as if it was held. With ℓ its lift, a the acceleration that
/// closes the gap: in flight for 2ℓ/a it misses the impulse 2ℓ/G_ii, and its landing gives ℓ/G_ii;
/// held, it gets −ℓ/G_ii at the impact.)
struct DegeneratePush {
  int constraint = 0;
  int hit = 0;         ///< whose impact it is
  ConstraintSet held;  ///< contacts at rest that it does push
  Vector v;            ///< before it [d]
};

/// What is asked of the sequences, and where they end early.
struct SequenceRules {
  std::vector<double> rest;  ///< speeds that count as zero, by constraint [n]
  /// Whether two velocities are one outcome.
  std::function<bool(const Vector&, const Vector&)> same;
  std::size_t max_orders = kMaxListedOrders;
  ConstraintSet shut;  ///< contacts beyond J⁻ that touch without force, and rest at the beginning
};

/// The sequences of single impacts from (ρ, v⁻), in the limit of small separations w → 0.
///
/// Between two impacts a time O(|w|) passes. A contact at rest whose force would have to pull then
/// is ajar: it opens by O(|w|²) only, takes no part in the next impact, and is hit right after it,
/// before all others, when it is pushed. A contact that is ajar and falls back may have returned by
/// the next impact, or not: both are followed. So are both for a force that vanishes at v⁻, and for
/// one that is zero.
class ImpactSequences {
 public:
  ImpactSequences(ContactDynamics* dynamics, const Transition& transition,
                  const TouchingFrame& frame, SequenceRules rules);

  std::vector<OrderOutcome> outcomes;
  std::vector<ConstraintSet> resting;  ///< after each of them, ajar ones too
  bool all = true;                     ///< all sequences were followed
  bool simple = true;                  ///< every constraint of I_a is hit exactly once, no other is
  bool staged = true;  ///< v_S and what rests are the same for every order of the impacts in S
  ConstraintSet ajar;  ///< contacts that are ajar at some impact
  std::vector<DegeneratePush> degenerate;

 private:
  struct State {
    Vector v;
    ConstraintSet resting, ajar;
  };
  std::vector<State> AfterAWhile(const State& state);
  std::vector<State> Branches(const State& state, ConstraintSet doubtful) const;
  void Visit(const State& state, bool later);
  void Hit(const State& state, int i);
  State After(const State& state, int i, const ImpactResult& impact) const;
  void RecordStage(const State& state);
  void RecordDegenerate(const State& before, const State& after, int i, const ImpactResult& impact);
  void Finish(const State& state, bool cut);
  Vector StateAt(const Vector& v) const;
  double Rate(int i, const Vector& v) const { return frame_.Rate(i, v); }
  double Rest(int i) const { return rules_.rest[static_cast<std::size_t>(i)]; }

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Transition& transition_;
  const TouchingFrame& frame_;
  const SequenceRules rules_;
  const Vector q_;
  const ConstraintSet pressed_;
  const int longest_;
  OrderOutcome path_;
  std::map<ConstraintSet, State> stages_;
  std::map<std::vector<int>, std::vector<std::size_t>> found_;  // outcomes of each order
  long visits_ = 0;
};

}  // namespace contact_flow
