// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/force_jumps.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "contact_flow/budget.h"
#include "contact_flow/derivative/cluster_class.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/impact.h"
#include "src/dynamics/mode_selection.h"

namespace contact_flow {
namespace {

/// |Da_j v| below this part of the approach speeds counts as rest; the event map uses
/// the same figure.
constexpr double kRest = 1e-6;

/// The subsets of a set, in increasing size.
std::vector<ConstraintSet> Subsets(ConstraintSet set) {
  std::vector<ConstraintSet> subsets = {ConstraintSet()};
  for (int i : set) {
    const std::size_t count = subsets.size();
    for (std::size_t k = 0; k < count; ++k) subsets.push_back(subsets[k].With(i));
  }
  std::stable_sort(subsets.begin(), subsets.end(),
                   [](ConstraintSet a, ConstraintSet b) { return a.Size() < b.Size(); });
  return subsets;
}

/// The stages of a cluster whose v_S does not depend on the order of the impacts in S.
class Stages {
 public:
  Stages(const MechanicalSystem& system, const VectorRef& u, const Transition& transition)
      : system_(system),
        transition_(transition),
        q_(transition.x_minus.head(system.num_positions())),
        dynamics_(system, u) {
    ConstraintTerms terms;
    const Vector v = transition.x_minus.tail(system.dof());
    system.Constraints(q_, v, &terms);
    jacobian_ = terms.jacobian.topRows(system.num_constraints());
    rest_ = kRest * (1 + (jacobian_ * v).cwiseAbs().maxCoeff());
    velocity_[ConstraintSet()] = v;
  }

  /// v_S. Its subsets must have been asked for before.
  const Vector& VelocityAfter(ConstraintSet S) {
    const auto known = velocity_.find(S);
    if (known != velocity_.end()) return known->second;
    if (S == transition_.activated) return velocity_[S] = transition_.x_plus.tail(q_.size());
    const int last = *S.begin();
    const ConstraintSet before = S.Without(last);
    const Vector& v = velocity_.at(before);
    return velocity_[S] =
               SolveImpact(system_, q_, v, RestingAt(before, v).With(last), transition_.impact_law)
                   .v_plus;
  }

  /// The contacts that rest at v_S: of J⁻, and of S those that have not bounced.
  ConstraintSet RestingAt(ConstraintSet S, const Vector& v) const {
    ConstraintSet resting;
    for (int i : (transition_.mode_before - system_.compliant()) | S) {
      const bool bounced = S.Contains(i) && system_.restitution()(i) > 0;
      if (!bounced && std::abs(jacobian_.row(i).dot(v)) <= rest_) resting.Insert(i);
    }
    return resting;
  }

  /// λ_i and its rate at v_S in the mode K_S ∪ {i}, for every contact that rests.
  std::map<int, StageForce> Forces(ConstraintSet S) {
    const Vector& v = VelocityAfter(S);
    Vector x(q_.size() + v.size());
    x << q_, v;
    const ConstraintSet resting = RestingAt(S, v);
    const ConstraintSet pressed = transition_.mode_before & system_.compliant();
    const ContactMode mode = SelectContactMode(&dynamics_, x, resting, {}, pressed);
    std::map<int, StageForce> forces;
    for (int i : resting) {
      const double rate = dynamics_.ForceRate(x, mode.With(i), i);
      dynamics_.Evaluate(x, mode.With(i));
      forces[i] = {S, dynamics_.force()(i), rate};
    }
    return forces;
  }

 private:
  const MechanicalSystem& system_;
  const Transition& transition_;
  const Vector q_;
  ContactDynamics dynamics_;
  Matrix jacobian_;
  double rest_ = 0;
  std::map<ConstraintSet, Vector> velocity_;
};

/// Whether v_S is the same for every order of the impacts in S.
bool OrderIsIrrelevant(const MechanicalSystem& system, const VectorRef& u,
                       const Transition& transition) {
  if (transition.activated.Size() < 2) return true;
  ContactDynamics dynamics(system, u);
  const ClusterReport cluster = ClassifyCluster(&dynamics, transition);
  switch (cluster.contact_class) {
    case ContactClass::kSingle:
    case ContactClass::kOrthogonal:
    case ContactClass::kAttracting:
      return true;
    case ContactClass::kOrdersAgree:
      return cluster.staged;
    default:
      return false;
  }
}

/// `zero`: forces below it have no sign.
ForceFate Judge(const ForceJump& jump, const Transition& transition, double zero) {
  // A force that passes zero as an event of its own, here too, is negative right after.
  const auto passes_zero = [&](const StageForce& stage) {
    return transition.vanishing.Contains(jump.constraint) && std::abs(stage.force) <= zero &&
           stage.rate < 0;
  };
  const auto lets_go = [&](const StageForce& stage) {
    return stage.force < -zero || passes_zero(stage);
  };
  bool regained = false, near_zero = false, negative = false;
  for (const StageForce& stage : jump.stages) {
    near_zero = near_zero || (!passes_zero(stage) && !(std::abs(stage.force) > zero));
    negative = negative || lets_go(stage);
    for (const StageForce& earlier : jump.stages) {
      const bool leads_here = (earlier.activated - stage.activated).Empty();
      regained = regained || (leads_here && lets_go(earlier) && stage.force > zero);
    }
  }
  if (near_zero) return ForceFate::kNearZero;
  if (regained) return ForceFate::kRegained;
  const bool stays = transition.mode_after.Contains(jump.constraint);
  return negative || !stays ? ForceFate::kReleased : ForceFate::kKeeps;
}

}  // namespace

const char* ForceFateName(ForceFate fate) {
  switch (fate) {
    case ForceFate::kKeeps:
      return "keeps";
    case ForceFate::kReleased:
      return "released";
    case ForceFate::kRegained:
      return "regained";
    case ForceFate::kNearZero:
      return "near zero";
  }
  return "unknown";
}

bool ForceJumpReport::smooth() const {
  return std::all_of(contacts.begin(), contacts.end(), [](const ForceJump& jump) {
    return jump.fate == ForceFate::kKeeps || jump.fate == ForceFate::kReleased;
  });
}

ForceJumpReport AssessForceJumps(const MechanicalSystem& system, const VectorRef& u,
                                 const Transition& transition, double tolerance) {
  ForceJumpReport report;
  const bool unknown = system.HasFriction() || system.HasContactEffort();
  if (unknown || transition.completes_zeno || !transition.switched.Empty() ||
      transition.activated.Size() > kMaxStagedActivations ||
      !OrderIsIrrelevant(system, u, transition)) {
    return report;
  }
  report.computed = true;
  if (transition.activated.Empty()) return report;  // the state is continuous: no force jumps
  Stages stages(system, u, transition);
  std::map<int, ForceJump> jumps;
  double largest = 0;
  for (ConstraintSet S : Subsets(transition.activated)) {
    AskBudget();
    for (const auto& [i, force] : stages.Forces(S)) {
      jumps[i].constraint = i;
      jumps[i].stages.push_back(force);
      largest = std::max(largest, std::abs(force.force));
    }
  }
  for (auto& [i, jump] : jumps) {
    jump.fate = Judge(jump, transition, tolerance * largest);
    report.contacts.push_back(std::move(jump));
  }
  return report;
}

}  // namespace contact_flow
