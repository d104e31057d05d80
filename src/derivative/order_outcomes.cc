// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/order_outcomes.h"

#include "cluster_geometry.h"
#include "impact_sequences.h"
#include "neglected_coupling.h"

namespace contact_flow {
namespace {

/// Velocities that differ by less than this, relative, are one outcome.
constexpr double kSame = 1e-12;

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
  std::vector<OrderOutcome> outcomes = ImpactSequences(dynamics, transition, frame, rules).outcomes;
  const int several = (transition.activated | transition.touching).Size();
  if (transition.touching.Empty() || several > kMaxOrderedActivations) return outcomes;
  rules.shut = ConstraintSet();
  for (const OrderOutcome& open : ImpactSequences(dynamics, transition, frame, rules).outcomes) {
    outcomes.push_back(open);
  }
  return outcomes;
}

}  // namespace contact_flow
