// SPDX-License-Identifier: BSD-3-Clause
// What a cluster begins with, and whether the order of its impacts decides the outcome.
#include <algorithm>
#include <cmath>
#include <utility>

#include "cluster_geometry.h"
#include "contact_flow/derivative/event_map.h"
#include "contact_flow/model/driven.h"
#include "contact_flow/model/row_layout.h"
#include "friction_part.h"
#include "frictional_event.h"

namespace contact_flow {
namespace {

/// A normal speed below this part of the largest approach speed counts as rest, both in
/// the kinetic metric.
constexpr double kRestingSpeed = 1e-6;
/// … and so does what contacts of J⁻ move with, times this, and what rounding leaves of a speed.
constexpr double kDrift = 10, kStageRounding = 1e-12;
/// Speeds are known to this many tolerances.
constexpr double kKnown = 10;

std::vector<int> Members(ConstraintSet set) {
  std::vector<int> members;
  for (int i : set) members.push_back(i);
  return members;
}

}  // namespace

EventMap::EventMap(std::shared_ptr<ContactDynamics> dynamics, const Transition& transition)
    : EventMap(std::move(dynamics), transition, {}) {}

EventMap::EventMap(std::shared_ptr<ContactDynamics> dynamics, const Transition& transition,
                   std::vector<std::shared_ptr<ContactDynamics>> later)
    : dynamics_(std::move(dynamics)),
      later_(std::move(later)),
      system_(&dynamics_->system()),
      transition_(transition),
      events_(transition.activated | transition.switched),
      q_(transition.x_minus.head(system_->num_positions())) {
  for (int c = 0; c < num_input_changes(); ++c) events_.Insert(system_->num_constraints() + c);
  Begin();
}

void EventMap::Begin() {
  const Vector v_minus = transition_.x_minus.tail(system_->dof());
  AddGuards(v_minus);
  const bool moves = !(events_.Empty() && transition_.vanishing.Empty());
  if (system_->HasFriction() && !(moves && !FrictionTakesPart(dynamics_.get(), transition_))) {
    std::vector<Vector> inputs;
    for (const auto& dynamics : later_) inputs.push_back(dynamics->u());
    auto event = std::make_shared<FrictionalEvent>(dynamics_, transition_, std::move(inputs));
    status_ = event->status();
    cluster_.outcomes = event->outcomes();
    friction_ = std::move(event);
    return;
  }
  if (system_->HasContactEffort() && !transition_.vanishing.Empty()) AddReleases();
  activated_ = Members(events_);
  if (!events_.Empty()) {
    sparse_guards_ = SparseRows(guards_);
    geometry_ = std::make_shared<ClusterGeometry>(*dynamics_, WithoutAside());
    MeasureRest(v_minus);
  }
  AddInstant(ConstraintSet(), v_minus);
  StageAt(ConstraintSet());
  Classify();
}

void EventMap::AddGuards(const Vector& v_minus) {
  const int d = system_->dof(), c = num_input_changes();
  const int k = dynamics_->num_variables() + c;
  ConstraintTerms terms;
  system_->Constraints(q_, v_minus, &terms);
  const RowLayout rows(*system_);
  const int n = rows.normal();
  guards_.setZero(n + c, 2 * d + k);
  guards_.topLeftCorner(n, d) = rows.Normal(terms.jacobian);
  guards_.bottomRightCorner(c, c).setIdentity();
  bilateral_.setZero(rows.bilateral(), 2 * d + k);
  bilateral_.leftCols(d) = rows.Bilateral(terms.jacobian);
  const std::vector<int>& parameters = dynamics_->variables().parameters;
  if (parameters.empty()) return;
  ParameterJacobian by_parameter;
  system_->DifferentiateImpactByParameters(q_, Vector::Zero(d), Vector::Zero(terms.jacobian.rows()),
                                           v_minus, parameters, &by_parameter);
  const auto p = static_cast<Eigen::Index>(parameters.size());
  guards_.block(0, width() - p, n, p) = rows.Normal(by_parameter.gap);
  bilateral_.middleCols(width() - p, p) = rows.Bilateral(by_parameter.gap);
}

void EventMap::MeasureRest(const Vector& v) {
  const Vector& mobility = geometry_->mobility();
  double approach = 0, drift = 0;
  for (int i : transition_.activated) {
    approach = std::max(approach, std::abs(geometry_->Rate(i, v)) / mobility(i));
  }
  for (int j : transition_.mode_before - Aside()) {
    drift = std::max(drift, std::abs(geometry_->Rate(j, v)) / mobility(j));
  }
  const Matrix& mass = geometry_->inertia()->mass();
  double speed = KineticSpeed(mass, v);  // in the kinetic metric
  if (!Driven(mass).empty()) {
    const Vector driven = v - Moved(mass, v);
    for (int i : transition_.activated | (transition_.mode_before - Aside())) {
      speed = std::max(speed, std::abs(geometry_->Rate(i, driven)) / mobility(i));
    }
  }
  const double lost = kDrift * drift + kStageRounding * speed;
  rest_ = kRestingSpeed * approach + lost;
  known_ = kKnown * transition_.relative_tolerance * approach + lost;
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

ConstraintSet EventMap::Aside() const {
  return system_->compliant() | (transition_.mode_before & ContactsWithFriction(*system_));
}

ContactMode EventMap::ModeAside(ConstraintSet events) const {
  const ConstraintSet before = transition_.mode_before & system_->compliant();
  const ConstraintSet switched = events & transition_.switched;
  const ContactMode pressed((before - switched) | (switched - before));
  if (!system_->HasFriction()) return pressed;
  return transition_.mode_before.Among(ContactsWithFriction(*system_)).Union(pressed);
}

/// The transition without the contacts with friction that go on aside.
Transition EventMap::WithoutAside() const {
  Transition own = transition_;
  const ConstraintSet rough = ContactsWithFriction(*system_);
  own.mode_before = own.mode_before.Without(rough);
  own.mode_after = own.mode_after.Without(rough);
  return own;
}

void EventMap::Classify() {
  if (!status_.ok()) return;
  cluster_ = ClassifyCluster(dynamics_.get(), WithoutAside(), geometry_.get());
  for (OrderOutcome& outcome : cluster_.outcomes) {
    outcome.mode_after = ModeAside(events_).Union(outcome.mode_after);
  }
  status_ = cluster_.status;
  decoupled_ = cluster_.decoupled;
}

}  // namespace contact_flow
