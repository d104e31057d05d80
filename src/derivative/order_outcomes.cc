// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/order_outcomes.h"

#include <algorithm>

#include "cluster_geometry.h"
#include "impact_sequences.h"
#include "neglected_coupling.h"

namespace contact_flow {
namespace {

/// Velocities that differ by less than this, relative, are one outcome.
constexpr double kSame = 1e-12;
/// An order may end in so many ways: more are not looked for.
constexpr std::size_t kEndsOfOrder = 2;

std::size_t MostListed(ConstraintSet hit) {
  std::size_t orders = kEndsOfOrder;
  for (int k = 2; k <= hit.Size(); ++k) orders *= static_cast<std::size_t>(k);
  return std::min(orders, kMaxListedOrders);
}

}  // namespace

std::vector<OrderOutcome> ListOrderOutcomes(ContactDynamics* dynamics,
                                            const Transition& transition) {
  if (transition.activated.Size() > kMaxOrderedActivations) return {};
  const MechanicalSystem& system = dynamics->system();
  ClusterGeometry geometry(*dynamics, transition);
  const TouchingFrame frame(
      system, *geometry.inertia(),
      (transition.mode_before - system.compliant()) | transition.activated | transition.touching,
      transition.impact_law);
  const NeglectedCoupling neglected(dynamics, transition, frame, &geometry);
  SequenceRules rules;
  rules.rest.resize(static_cast<std::size_t>(system.num_constraints()));
  for (int i : frame.touching) rules.rest[static_cast<std::size_t>(i)] = neglected.Rest(i);
  rules.same = [](const Vector& a, const Vector& b) {
    return (a - b).cwiseAbs().maxCoeff() <= kSame * (1 + a.cwiseAbs().maxCoeff());
  };
  rules.shut = transition.touching;
  rules.max_orders = MostListed(transition.activated);
  std::vector<OrderOutcome> outcomes = ImpactSequences(dynamics, transition, frame, rules).outcomes;
  const ConstraintSet both = transition.activated | transition.touching;
  if (transition.touching.Empty() || both.Size() > kMaxOrderedActivations) return outcomes;
  rules.shut = ConstraintSet();
  rules.max_orders = MostListed(both);
  for (const OrderOutcome& open : ImpactSequences(dynamics, transition, frame, rules).outcomes) {
    outcomes.push_back(open);
  }
  return outcomes;
}

}  // namespace contact_flow
