// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/order_outcomes.h"

#include <cmath>
#include <string>

#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/mode_selection.h"

namespace contact_flow {
namespace {

constexpr double kRest = 1e-9;  // relative to the approach speeds

/// Depth-first search over the sequences of single impacts at one configuration.
class Search {
 public:
  Search(ContactDynamics* dynamics, const Transition& transition)
      : dynamics_(*dynamics),
        system_(dynamics->system()),
        q_(transition.x_minus.head(system_.num_positions())),
        pressed_(transition.mode_after & system_.compliant()),
        touching_((transition.mode_before - system_.compliant()) | transition.activated),
        longest_(kMaxImpactsPerActivation * transition.activated.Size()) {
    ConstraintTerms terms;
    const Vector v = transition.x_minus.tail(system_.dof());
    system_.Constraints(q_, v, &terms);
    jacobian_ = terms.jacobian;
    rest_ = kRest * (1 + (jacobian_ * v).cwiseAbs().maxCoeff());
    path_.impulse = Vector::Zero(system_.num_constraints() + system_.num_bilateral());
    Visit(v, transition.mode_before - system_.compliant());
  }

  std::vector<OrderOutcome> outcomes;

 private:
  void Visit(const Vector& v, ContactMode resting) {
    const Vector rate = jacobian_ * v;
    const bool cut = static_cast<int>(path_.order.size()) >= longest_;
    bool approaching = false;
    for (int i : touching_ - resting) {
      if (outcomes.size() >= kMaxListedOrders) return;
      if (rate(i) >= -rest_) continue;
      approaching = true;
      if (cut) break;
      const ImpactResult impact = SolveImpact(system_, q_, v, resting.With(i));
      const Vector after = jacobian_ * impact.v_plus;
      ContactMode still;
      for (int j : resting.With(i)) {
        const bool bounced = impact.hit.Contains(j) && system_.restitution()(j) > 0;
        if (!bounced && std::abs(after(j)) <= rest_) still.Insert(j);
      }
      path_.order.push_back(i);
      path_.impulse += impact.impulse;
      Visit(impact.v_plus, still);
      path_.impulse -= impact.impulse;
      path_.order.pop_back();
    }
    if ((approaching && !cut) || outcomes.size() >= kMaxListedOrders) return;
    OrderOutcome outcome = path_;
    outcome.v_plus = v;
    outcome.mode_after = resting | pressed_;
    if (approaching) {
      outcome.status = {Outcome::kZeno, "after " + std::to_string(longest_) +
                                            " impacts contacts still approach: the order was cut"};
    } else {
      FindMode(resting, &outcome);
    }
    outcomes.push_back(outcome);
  }

  void FindMode(ContactMode resting, OrderOutcome* outcome) {
    Vector x(q_.size() + outcome->v_plus.size());
    x << q_, outcome->v_plus;
    try {
      outcome->mode_after = SelectContactMode(&dynamics_, x, resting, 0, pressed_);
    } catch (const UndecidedMode& reason) {
      outcome->status = {Outcome::kFilippov, reason.what()};
    }
  }

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Vector q_;
  const ContactMode pressed_;
  const ContactMode touching_;
  const int longest_;
  Matrix jacobian_;
  double rest_ = 0;
  OrderOutcome path_;
};

}  // namespace

std::vector<OrderOutcome> ListOrderOutcomes(ContactDynamics* dynamics,
                                            const Transition& transition) {
  if (transition.activated.Size() > kMaxOrderedActivations) return {};
  return Search(dynamics, transition).outcomes;
}

}  // namespace contact_flow
