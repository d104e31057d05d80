// SPDX-License-Identifier: BSD-3-Clause
// The stages of a cluster: what EventMap knows of (ρ, v_S), K_S, F_S and of the resets between
// them.
#include <cmath>
#include <utility>

#include "contact_flow/derivative/event_map.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/mode_selection.h"

namespace contact_flow {
namespace {

/// |Da_j v| below this part of the approach speeds counts as rest.
constexpr double kRest = 1e-6;

std::vector<int> Members(ContactMode mode) {
  std::vector<int> members;
  for (int i : mode) members.push_back(i);
  return members;
}

}  // namespace

EventMap::EventMap(std::shared_ptr<ContactDynamics> dynamics, const Transition& transition)
    : dynamics_(std::move(dynamics)),
      system_(&dynamics_->system()),
      transition_(transition),
      events_(transition.activated | transition.switched),
      q_(transition.x_minus.head(system_->num_positions())) {
  const int d = system_->dof(), k = dynamics_->num_variables();
  const Vector v_minus = transition.x_minus.tail(d);
  ConstraintTerms terms;
  system_->Constraints(q_, v_minus, &terms);
  const int n = system_->num_constraints();
  jacobian_ = terms.jacobian.topRows(n);
  guards_.setZero(n, 2 * d + k);
  guards_.leftCols(d) = jacobian_;
  const std::vector<int>& parameters = dynamics_->variables().parameters;
  if (!parameters.empty()) {
    ParameterJacobian by_parameter;
    system_->DifferentiateImpactByParameters(q_, Vector::Zero(d),
                                             Vector::Zero(terms.jacobian.rows()), v_minus,
                                             parameters, &by_parameter);
    guards_.rightCols(parameters.size()) = by_parameter.gap.topRows(n);
  }
  if (system_->HasContactEffort() && !transition.vanishing.Empty()) AddReleases();
  activated_ = Members(events_);
  stages_[ContactMode()] = {v_minus, transition.mode_before,
                            dynamics_->Field(transition.x_minus, transition.mode_before)};
  Classify();
}

Vector EventMap::State(const Vector& v) const {
  Vector x(q_.size() + v.size());
  x << q_, v;
  return x;
}

/// Where the effort depends on the mode, a force that vanishes is the crossing of a surface between
/// two fields.
void EventMap::AddReleases() {
  if (transition_.vanishing.Size() > 1 || !events_.Empty()) {
    status_ = {Outcome::kNotDifferentiable, "at t = " + std::to_string(transition_.t) +
                                                " s a contact lets go together with another event "
                                                "while the effort depends on the contact "
                                                "mode: such clusters are not differentiated"};
    return;
  }
  dynamics_->Differentiate(transition_.x_minus, transition_.mode_before);
  for (int i : transition_.vanishing) guards_.row(i) = dynamics_->force_jacobian().row(i);
  events_ = transition_.vanishing;
}

ContactMode EventMap::Pressed(ContactMode events) const {
  const ContactMode before = transition_.mode_before & system_->compliant();
  const ContactMode switched = events & transition_.switched;
  return (before - switched) | (switched - before);
}

void EventMap::Classify() {
  if (!status_.ok()) return;
  cluster_ = ClassifyCluster(dynamics_.get(), transition_);
  status_ = cluster_.status;
  decoupled_ = cluster_.decoupled;
}

ContactMode EventMap::Resting(const Vector& v, ContactMode candidates, ContactMode elastic) const {
  const Vector approach = jacobian_ * transition_.x_minus.tail(system_->dof());
  const double rest = kRest * (1 + approach.cwiseAbs().maxCoeff());
  ContactMode resting;
  for (int j : candidates - elastic) {
    if (std::abs(jacobian_.row(j).dot(v)) <= rest) resting.Insert(j);
  }
  return resting;
}

const EventMap::Stage& EventMap::Activate(ContactMode activated, int i,
                                          const Matrix** reset) const {
  const Stage& stage = StageAt(activated);
  const ContactMode next = activated.With(i);
  const auto known_reset = resets_.find({activated, i});
  if (known_reset != resets_.end()) {
    *reset = &known_reset->second;
    return StageAt(next);
  }
  const auto known_stage = stages_.find(next);
  if (!transition_.activated.Contains(i)) {  // no impact: the field changes, the state does not
    *reset = &(resets_[{activated, i}] = Matrix::Identity(size(), size()));
    if (known_stage != stages_.end()) return known_stage->second;
    Stage after = stage;
    const ContactMode resting =
        Resting(stage.v, transition_.mode_before | activated, ContactMode());
    after.mode = next == events_
                     ? transition_.mode_after
                     : SelectContactMode(dynamics_.get(), State(after.v),
                                         resting - system_->compliant(), 0, Pressed(next));
    after.field = dynamics_->Field(State(after.v), after.mode);
    return stages_[next] = after;
  }
  const ContactMode compliant = system_->compliant();
  const Variables& variables = dynamics_->variables();
  ContactMode elastic;  // members of S that have bounced
  for (int j : next) {
    if (system_->restitution()(j) > 0) elastic.Insert(j);
  }
  // Every contact that rests takes part in the impact, even one whose force would have to pull now:
  // it has opened by O(|w|²) only, and is closed again if this impact pushes it. Those that bounced
  // take no part.
  const ContactMode touching =
      (stage.mode | Resting(stage.v, transition_.mode_before | activated, elastic)).With(i) -
      compliant;
  const ImpactResult impact = SolveImpact(*system_, q_, stage.v, touching, transition_.impact_law);
  // To first order, contacts in the mode keep their constraint, and so does one that is closed
  // again.
  const ContactMode persisting =
      Resting(impact.v_plus, (stage.mode | impact.hit).Without(i) - compliant, ContactMode());
  Matrix& derivative = resets_[{activated, i}];
  derivative =
      ImpactJacobian(*system_, q_, stage.v, impact, persisting.With(i), persisting, variables);
  *reset = &derivative;

  Stage after;
  if (known_stage != stages_.end()) {
    after = known_stage->second;
  } else {
    after.v = impact.v_plus;
    const ContactMode resting = Resting(after.v, transition_.mode_before | next, elastic);
    after.mode = next == events_ ? transition_.mode_after
                                 : SelectContactMode(dynamics_.get(), State(after.v),
                                                     resting - compliant, 0, Pressed(next));
    after.field = dynamics_->Field(State(after.v), after.mode);
  }
  // A contact that let go at an earlier stage and holds again at this one has opened by O(|w|²) and
  // falls back with a speed O(|w|): its plastic impact is one more reset, which no time separates
  // from this.
  const ContactMode held = after.mode - compliant, regained = held - persisting.With(i);
  if (!regained.Empty()) {
    ImpactResult closing;
    closing.v_plus = after.v;
    closing.impulse = Vector::Zero(system_->num_constraints() + system_->num_bilateral());
    derivative = ImpactJacobian(*system_, q_, after.v, closing, held, held, variables) * derivative;
  }
  return known_stage != stages_.end() ? known_stage->second : stages_[next] = after;
}

}  // namespace contact_flow
