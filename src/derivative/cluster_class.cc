// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/cluster_class.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "cluster_geometry.h"
#include "contact_flow/model/driven.h"
#include "contact_groups.h"
#include "impact_sequences.h"
#include "neglected_coupling.h"
#include "touching_contacts.h"
#include "touching_frame.h"

namespace contact_flow {
namespace {

/// Entries of Δ that differ by less than this, relative, are the same, where no
/// transition says better.
constexpr double kOrthogonal = 1e-6;
/// Velocities are one outcome below this, relative, whatever the tolerances.
constexpr double kClassRounding = 1e-12;
/// Orders that are tried where there are too many to follow all.
constexpr std::size_t kTried = 500;

class Classifier {
 public:
  Classifier(ContactDynamics* dynamics, const Transition& transition, ConstraintSet touching,
             ClusterGeometry* geometry)
      : dynamics_(*dynamics),
        system_(dynamics->system()),
        transition_(transition),
        geometry_(*geometry),
        frame_(system_, *geometry->inertia(), touching, transition.impact_law),
        neglected_(dynamics, transition, frame_, geometry) {
    report_.neglected_jump = Vector::Zero(system_.dof());
  }

  ClusterReport Report() {
    SortIntoGroups();
    const ConstraintSet open = transition_.touching & coupled_;
    if (!open.Empty() &&
        !JudgeTouching(&dynamics_, transition_, frame_, open, Rules(kTried), &report_)) {
      return report_;
    }
    const ConstraintSet vanishing = transition_.vanishing & frame_.touching & coupled_;
    const int impacts = transition_.activated.Size();
    const bool decided = impacts > 1 || !vanishing.Empty();
    const bool followed = (transition_.activated | vanishing).Size() <= kMaxClassifiedEvents;
    const bool fixed = system_.HasConstantMass() && system_.HasAffineConstraints() &&
                       dynamics_.variables().parameters.empty();
    if (coupled_.Empty() || !decided) {
      if (impacts == 1) report_.contact_class = ContactClass::kSingle;
      if (!fixed) CheckSlopes(followed);
      return report_;
    }
    const ImpactSequences sequences(&dynamics_, transition_, frame_,
                                    Rules(followed ? kMaxListedOrders : kTried));
    JudgeOrders(sequences);
    if (report_.status.ok() && !fixed) JudgeSlopes(sequences.degenerate);
    return report_;
  }

 private:
  void SortIntoGroups() {
    const auto orthogonal = [this](int i, int j) { return neglected_.Orthogonal(i, j); };
    for (int i : frame_.touching) {
      for (int j : frame_.touching) {
        if (j <= i || !orthogonal(i, j)) continue;
        report_.neglected_jump += neglected_.Jump(i, j);
        report_.neglected_derivative += neglected_.JumpOfDerivative(i, j);
      }
    }
    report_.contact_class = ContactClass::kOrthogonal;
    for (ConstraintSet group : Groups(frame_.touching, orthogonal)) {
      // Nothing is given to groups without an impact.
      if (group.Size() < 2 || (group & transition_.activated).Empty()) continue;
      report_.decoupled = false;
      if (Harmless(frame_, group, orthogonal)) {
        report_.contact_class = ContactClass::kAttracting;
      } else {
        coupled_ = coupled_ | group;
      }
    }
  }

  SequenceRules Rules(std::size_t max_orders) const {
    SequenceRules rules;
    rules.max_orders = max_orders;
    rules.rest.resize(static_cast<std::size_t>(system_.num_constraints()));
    for (int i : frame_.touching) rules.rest[static_cast<std::size_t>(i)] = neglected_.Rest(i);
    rules.same = [this](const Vector& a, const Vector& b) { return Same(a, b); };
    rules.shut = transition_.touching;
    return rules;
  }

  /// Both within the error of the outcome and, in the kinetic metric, small beside the impact.
  bool Same(const Vector& a, const Vector& b) const {
    const Vector apart = (a - b).cwiseAbs();
    if ((apart.array() <= kClassRounding * (a.cwiseAbs() + b.cwiseAbs()).array()).all())
      return true;
    if (!(apart.array() <= neglected_.outcome_limit().array()).all()) return false;
    const Vector v = transition_.x_minus.tail(system_.dof());
    const double impact = KineticNorm(a - v);
    return KineticNorm(a - b) <=
           neglected_.derivative_limit() * impact + kClassRounding * KineticNorm(v);
  }

  double KineticNorm(const Vector& v) const { return KineticSpeed(geometry_.inertia()->mass(), v); }

  void JudgeOrders(const ImpactSequences& sequences) {
    const Vector v_plus = transition_.x_plus.tail(system_.dof());
    ConstraintSet resting;
    for (int i : frame_.touching) {
      const bool bounced = transition_.activated.Contains(i) && frame_.Restitution(i) > 0;
      if (!bounced && std::abs(frame_.Rate(i, v_plus)) <= neglected_.Rest(i)) resting.Insert(i);
    }
    report_.staged = sequences.staged;
    Vector apart = Vector::Zero(system_.dof());
    double largest = -1;
    const char* what = nullptr;
    bool ended = true;
    for (std::size_t k = 0; k < sequences.outcomes.size(); ++k) {
      const OrderOutcome& outcome = sequences.outcomes[k];
      const Vector difference = (outcome.v_plus - v_plus).cwiseAbs();
      if (outcome.status.ok()) {
        if (!Same(outcome.v_plus, v_plus)) {
          what = "velocities";
          largest = std::max(largest, difference.maxCoeff());
        } else if (what == nullptr && (outcome.mode_after != transition_.mode_after ||
                                       sequences.resting[k] != resting)) {
          what = "contacts at rest";
        }
        apart = apart.cwiseMax(difference);
      } else {
        ended = false;
      }
    }
    std::ostringstream reason;
    if (what != nullptr) {
      report_.contact_class = ContactClass::kOrderDependent;
      reason << "the order of impacts decides the outcome, which is discontinuous here: orders "
                "lead to different "
             << what;
      if (largest > 0) reason << ", " << largest << " apart";
      report_.status = {Outcome::kDiscontinuous, Sentence() + reason.str()};
      report_.outcomes =
          sequences.all ? sequences.outcomes : ListOrderOutcomes(&dynamics_, transition_);
    } else if (!sequences.all || !ended) {
      report_.contact_class = ContactClass::kUndecided;
      reason << "the orders that were followed agree, but not all were followed to their end: "
             << "whether the order of impacts decides the outcome is undecided";
      report_.status = {Outcome::kNotDifferentiable, Sentence() + reason.str()};
      if (sequences.all) report_.outcomes = sequences.outcomes;
    } else {
      report_.contact_class = ContactClass::kOrdersAgree;
      report_.neglected_jump += apart;
      const char* obstacle =
          !sequences.simple   ? "contacts are hit again within the cluster"
          : !sequences.staged ? "they pass through different velocities on the way"
          : !(sequences.ajar & coupled_).Empty() ? "a contact lets go between the impacts"
                                                 : nullptr;
      if (obstacle == nullptr) return;
      reason << "every order of impacts leads to the same outcome, which is continuous, but "
             << obstacle << ": such clusters are not differentiated";
      report_.status = {Outcome::kNotDifferentiable, Sentence() + reason.str()};
    }
  }

  /// Pairs that are orthogonal at ρ only. Where not all orders are followed, every contact that may
  /// rest counts as one that is not pressed.
  void CheckSlopes(bool followed) {
    if (followed) {
      JudgeSlopes(
          ImpactSequences(&dynamics_, transition_, frame_, Rules(kMaxListedOrders)).degenerate);
      return;
    }
    std::vector<DegeneratePush> pushes;
    for (int j : transition_.activated) {
      for (int i : frame_.touching.Without(j)) {
        const bool could_rest = transition_.mode_before.Contains(i) || frame_.Restitution(i) == 0;
        if (!could_rest || !neglected_.Orthogonal(i, j)) continue;
        pushes.push_back({i, j, ConstraintSet(), transition_.x_minus.tail(system_.dof())});
      }
    }
    JudgeSlopes(pushes);
  }

  void JudgeSlopes(const std::vector<DegeneratePush>& pushes) {
    double worst = 1;
    std::optional<ImpactLift> lift;
    for (const DegeneratePush& push : pushes) {
      if (!push.held.Empty() && transition_.activated.Size() == 1) continue;  // Germ follows it
      if (!lift || lift->impact().hit != push.hit || lift->impact().held != push.held ||
          lift->impact().v != push.v) {
        lift.emplace(neglected_.LiftBy(push.hit, push.held, push.v));
      }
      const ImpactLift::Change change = lift->At(push.constraint);
      if (change.share <= 1) {
        report_.neglected_derivative += change.entry;
      } else if (change.share > worst) {
        worst = change.share;
        std::ostringstream reason;
        reason << "are orthogonal here but not where both touch around here: Assumption 4 fails, "
                  "the impact of one may or may not lift the other, which changes the derivative "
                  "by up to "
               << change.entry;
        report_.status = {Outcome::kNotDifferentiable,
                          Sentence(push.constraint, push.hit) + reason.str()};
      }
    }
  }

  /// Names the two contacts that are coupled most, in the groups that are not harmless.
  std::string Sentence() const {
    int first = -1, second = -1;
    double coupling = 0;
    for (int i : coupled_) {
      for (int j : coupled_) {
        if (j <= i || neglected_.Orthogonal(i, j)) continue;
        const int a = frame_.Row(i), b = frame_.Row(j);
        const double value = frame_.G(a, b) / std::sqrt(frame_.G(a, a) * frame_.G(b, b));
        if (std::abs(value) <= std::abs(coupling)) continue;
        coupling = value;
        first = i;
        second = j;
      }
    }
    std::ostringstream message;
    message << Sentence(first, second)
            << "are not orthogonal in the kinetic metric (normalized G_ij = " << coupling << "): ";
    return message.str();
  }

  std::string Sentence(int first, int second) const {
    const std::vector<std::string>& names = system_.description().constraints;
    std::ostringstream message;
    message << "at t = " << transition_.t << " s the simultaneous contacts '"
            << names[static_cast<std::size_t>(std::min(first, second))] << "' and '"
            << names[static_cast<std::size_t>(std::max(first, second))] << "' ";
    return message.str();
  }

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Transition& transition_;
  const ClusterGeometry& geometry_;
  const TouchingFrame frame_;
  const NeglectedCoupling neglected_;
  ClusterReport report_;
  ConstraintSet coupled_;  // the groups that are not harmless
};

}  // namespace

const char* ContactClassName(ContactClass contact_class) {
  switch (contact_class) {
    case ContactClass::kSingle:
      return "single";
    case ContactClass::kOrthogonal:
      return "orthogonal";
    case ContactClass::kAttracting:
      return "attracting";
    case ContactClass::kOrderDependent:
      return "order-dependent";
    case ContactClass::kDependent:
      return "dependent";
    case ContactClass::kOrdersAgree:
      return "orders agree";
    case ContactClass::kUndecided:
      return "undecided";
  }
  return "unknown";
}

ClusterReport ClassifyCluster(ContactDynamics* dynamics, const Transition& transition,
                              ClusterGeometry* geometry) {
  const ConstraintSet touching = (transition.mode_before - dynamics->system().compliant()) |
                                 transition.activated | transition.touching;
  ClusterReport report;
  report.neglected_jump = Vector::Zero(dynamics->system().dof());
  if (transition.activated.Empty() || touching.Size() < 2) return report;
  try {
    std::optional<ClusterGeometry> own;
    if (geometry == nullptr) geometry = &own.emplace(*dynamics, transition);
    return Classifier(dynamics, transition, touching, geometry).Report();
  } catch (const std::domain_error& reason) {
    report.contact_class = ContactClass::kDependent;
    report.decoupled = false;
    std::ostringstream message;
    message << "at t = " << transition.t << " s " << reason.what();
    report.status = {Outcome::kNotDifferentiable, message.str()};
    return report;
  }
}

ContactClass ClassifyCouplings(const MechanicalSystem& system, const VectorRef& q,
                               ConstraintSet touching) {
  if (touching.Size() < 2) return ContactClass::kSingle;
  const InverseInertia inertia(system, q, Vector::Zero(system.dof()));
  const TouchingFrame frame(system, inertia, touching, ImpactLaw::kComplementarity);
  // Δ_i = I − (1+γ) Y_i A_i / G_ii; Δ_j Δ_i differs from Δ_i Δ_j by terms Y_j G_ij A_i.
  double largest = 1;
  const auto entry = [&](int j, int i) {
    const int a = frame.Row(i), b = frame.Row(j);
    return (1 + frame.Restitution(i)) * (1 + frame.Restitution(j)) *
           frame.Y.col(b).cwiseAbs().maxCoeff() * frame.A.row(a).cwiseAbs().maxCoeff() /
           (frame.G(a, a) * frame.G(b, b));
  };
  for (int i : touching) {
    const int a = frame.Row(i);
    largest = std::max(largest, entry(i, i) * frame.G(a, a) / (1 + frame.Restitution(i)));
  }
  const auto orthogonal = [&](int i, int j) {
    const double coupling = std::abs(frame.G(frame.Row(i), frame.Row(j)));
    return coupling * (entry(i, j) + entry(j, i)) <= kOrthogonal * largest;
  };
  ContactClass found = ContactClass::kOrthogonal;
  for (ConstraintSet group : Groups(touching, orthogonal)) {
    if (!Harmless(frame, group, orthogonal)) return ContactClass::kOrderDependent;
    if (group.Size() > 1) found = ContactClass::kAttracting;
  }
  return found;
}

}  // namespace contact_flow
