// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/validity_radius.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "cluster_returns.h"
#include "contact_flow/budget.h"
#include "contact_flow/model/driven.h"
#include "contact_flow/model/row_layout.h"
#include "effort_watches.h"
#include "friction_validity.h"
#include "src/dynamics/mode_selection.h"
#include "validity_margins.h"

namespace contact_flow {
namespace {

using Limit = ValidityRadius::Limit;

/// Step of the difference quotient of dλ/dt, along a tangent of unit length.
constexpr double kStep = 1e-6;

/// F at x before or behind the impact of a cluster, for the input of `dynamics`: in the mode of
/// those of `candidates` that rest and press there.
Vector FieldAt(ContactDynamics* dynamics, const Vector& x, ConstraintSet candidates,
               double speed_tolerance) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions();
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  ConstraintSet resting;
  for (int i : candidates - system.compliant()) {
    if (std::abs(terms.jacobian.row(i).dot(x.tail(d))) <= speed_tolerance) resting.Insert(i);
  }
  const ConstraintSet pressed = candidates & system.compliant();
  return dynamics->Field(x, SelectContactMode(dynamics, x, resting, {}, pressed));
}

/// The arc that follows transition k, or the cluster that it begins.
std::size_t ArcBehind(const BDerivative& derivative, std::size_t k) {
  std::size_t arc = k + 1;
  while (arc < derivative.events.size() && derivative.events[arc].absorbed()) ++arc;
  return arc;
}

}  // namespace

ValidityEstimator::ValidityEstimator(const MechanicalSystem& system, const Trajectory& trajectory,
                                     const BDerivative& derivative)
    : system_(system), trajectory_(trajectory), derivative_(derivative) {
  if (system.HasFriction()) {
    with_friction_ = std::make_unique<FrictionValidity>(system, trajectory, derivative);
    return;
  }
  efforts_ = std::make_unique<EffortWatches>(system, trajectory, derivative);
  const std::size_t arcs = trajectory.arcs.size();
  dips_.resize(arcs);
  begins_.resize(arcs);
  ends_.resize(arcs);
  for (std::size_t k = 0; k < arcs; ++k) {
    dynamics_.push_back(std::make_unique<ContactDynamics>(system, trajectory.arcs[k].u,
                                                          derivative.options.variables));
    AskBudget();
    // An arc inside a cluster has no length.
    if (k < derivative.events.size() && derivative.events[k].absorbed()) continue;
    WatchBegin(k);
    WatchDips(k);
    WatchEnd(k);
  }
  WatchStart();
}

ValidityEstimator::~ValidityEstimator() = default;

/// α at which the guard of a watch is zero, for the tangent w at its place, whose instant moves by
/// `shift` for every unit of α.
void ValidityEstimator::ConsiderWatch(const Watch& watch, const Vector& w, double shift,
                                      ValidityRadius* smallest) const {
  const double change = watch.gradient.dot(w) + watch.rate * shift;
  const double terms = watch.gradient.cwiseAbs().dot(w.cwiseAbs()) + std::abs(watch.rate * shift);
  if (!(change < -kMarginNoise * terms)) return;
  Consider(watch.value, change, watch.limit, watch.constraint, watch.t, smallest);
}

/// The approach speeds and release rates of transition k, for the tangent w before it.
void ValidityEstimator::CheckEvent(std::size_t k, const Vector& w, ValidityRadius* smallest) const {
  const Transition& transition = derivative_.events[k].transition();
  const int d = system_.dof(), nq = system_.num_positions();
  ContactDynamics& dynamics = *dynamics_[k];
  const Vector q = transition.x_minus.head(nq), v = transition.x_minus.tail(d);
  const Vector field = dynamics.Field(transition.x_minus, transition.mode_before);
  const bool changes = derivative_.events[k].num_input_changes() > 0;
  const Vector later = changes
                           ? FieldAt(dynamics_[ArcBehind(derivative_, k)].get(), transition.x_minus,
                                     transition.mode_before, trajectory_.speed_tolerance)
                           : field;
  ConstraintTerms terms;
  system_.Constraints(q, v, &terms);
  ResidualJacobian residual;
  const Vector no_impulse = Vector::Zero(terms.gap.size());
  system_.DifferentiateImpact(q, Vector::Zero(d), no_impulse, v, &residual);
  const std::vector<int>& parameters = dynamics.variables().parameters;
  const Vector by = w.tail(static_cast<Eigen::Index>(parameters.size()));
  ParameterJacobian by_parameter;
  if (!parameters.empty()) {
    system_.DifferentiateImpactByParameters(q, Vector::Zero(d), no_impulse, v, parameters,
                                            &by_parameter);
  }
  for (int i : transition.activated) {
    const double speed = terms.jacobian.row(i).dot(v);
    const double time = -GuardGradient(k, transition.x_minus, i).dot(w) / speed;
    // The input changes at 0.
    const Vector there = w + time * (time > 0 ? later : field);
    double change = residual.constraint_q.row(i).dot(there.head(d)) +
                    terms.jacobian.row(i).dot(there.segment(d, d));
    if (!parameters.empty()) change += by_parameter.constraint.row(i).dot(by);
    ConsiderFold(speed, change, Limit::kApproachSpeed, i, transition.t, smallest);
  }
  for (int i : transition.vanishing) {
    const double rate = dynamics.ForceRate(transition.x_minus, transition.mode_before, i);
    const double time = -GuardGradient(k, transition.x_minus, i).dot(w) / rate;
    const Vector there = (w + time * field).head(2 * d);
    const double length = there.norm();
    if (!(length > 0)) continue;
    const Vector aside = system_.Perturb(transition.x_minus, kStep / length * there);
    const double change =
        (dynamics.ForceRate(aside, transition.mode_before, i) - rate) * length / kStep;
    ConsiderFold(rate, change, Limit::kReleaseRate, i, transition.t, smallest);
  }
}

/// Contacts that rest while another one is hit: they are held by an impulse, which has to push, or
/// leave, p_j ≥ 0 ⟂ Da_j v⁺ ≥ 0. `w` and `after` are the tangents before and after transition k.
void ValidityEstimator::CheckImpact(std::size_t k, const Vector& w, const Vector& after,
                                    double time, ValidityRadius* smallest) const {
  const Transition& transition = derivative_.events[k].transition();
  if (transition.impact_law != ImpactLaw::kComplementarity) return;
  const ConstraintSet resting = transition.mode_before - system_.compliant() - transition.vanishing;
  const int d = system_.dof(), nq = system_.num_positions(), n = system_.num_constraints();
  const Vector q = transition.x_minus.head(nq), v_minus = transition.x_minus.tail(d),
               v_plus = transition.x_plus.tail(d);
  Vector impulse = Vector::Zero(system_.num_rows());
  impulse.head(transition.impulse.size()) = transition.impulse;
  ConstraintTerms terms;
  system_.Constraints(q, v_plus, &terms);
  Matrix mass;
  Vector force;
  system_.Dynamics(q, v_plus, trajectory_.arcs[k].u, {}, &mass, &force);
  ResidualJacobian residual;
  system_.DifferentiateImpact(q, v_plus - v_minus, impulse, v_plus, &residual);
  // The states just before and after the impact of the perturbed run.
  const std::size_t next = ArcBehind(derivative_, k);
  Vector field = dynamics_[k]->Field(transition.x_minus, transition.mode_before);
  Vector field_after = dynamics_[next]->Field(transition.x_plus, transition.mode_after);
  if (derivative_.events[k].num_input_changes() > 0) {  // at 0: before, or after the impact
    const double still = trajectory_.speed_tolerance;
    if (time > 0) {
      field = FieldAt(dynamics_[next].get(), transition.x_minus, transition.mode_before, still);
    } else {
      const ConstraintSet all = transition.mode_before | transition.activated;
      field_after = FieldAt(dynamics_[k].get(), transition.x_plus, all, still);
    }
  }
  const Vector at = w + time * field;
  const Vector behind = after + time * field_after;
  Vector momentum =
      residual.momentum_q * at.head(d) + mass * (behind.segment(d, d) - at.segment(d, d));
  Vector rates = residual.constraint_q * at.head(d) + terms.jacobian * behind.segment(d, d);
  const std::vector<int>& parameters = dynamics_[k]->variables().parameters;
  if (!parameters.empty()) {
    ParameterJacobian by_parameter;
    system_.DifferentiateImpactByParameters(q, v_plus - v_minus, impulse, v_plus, parameters,
                                            &by_parameter);
    const Vector change = w.tail(static_cast<Eigen::Index>(parameters.size()));
    momentum += by_parameter.momentum * change;
    rates += by_parameter.constraint * change;
  }
  // M (v⁺ − v⁻) = Daᵀ p of those that are hit and the bilateral ones, to first order.
  ConstraintSet pushed;
  for (int i = 0; i < n; ++i) {
    if (impulse(i) > 0) pushed.Insert(i);
  }
  const std::vector<int> hit = RowLayout(system_).Closed(pushed);
  Matrix reach(d, hit.size());
  for (std::size_t c = 0; c < hit.size(); ++c) {
    reach.col(static_cast<Eigen::Index>(c)) = terms.jacobian.row(hit[c]).transpose();
  }
  for (int j : Driven(mass)) {  // answers to all impulses
    reach.row(j).setZero();
    momentum(j) = 0;
  }
  const Vector changes = reach.completeOrthogonalDecomposition().solve(momentum);
  for (std::size_t c = 0; c < hit.size(); ++c) {
    const int j = hit[c];
    if (j >= n || !resting.Contains(j)) continue;
    Consider(impulse(j), changes(static_cast<Eigen::Index>(c)), Limit::kImpulse, j, transition.t,
             smallest);
  }
  for (int j : resting - transition.mode_after) {
    const double speed = terms.jacobian.row(j).dot(v_plus);
    if (speed > trajectory_.speed_tolerance) {
      Consider(speed, rates(j), Limit::kImpulse, j, transition.t, smallest);
    }
  }
}

ValidityRadius ValidityEstimator::operator()(const VectorRef& direction) const {
  if (with_friction_ != nullptr) return (*with_friction_)(direction);
  ValidityRadius smallest;
  Vector w = Vector::Zero(derivative_.arcs.front().cols());
  w.head(direction.size()) = direction;
  const StartCone::Bound bound = derivative_.start.Limit(w);
  if (bound.constraint >= 0) {
    smallest = {bound.alpha, Limit::kGap, bound.constraint, trajectory_.t_begin()};
    if (bound.alpha == 0) return smallest;
  }
  w = derivative_.start(w);
  for (const Watch& gap : starts_) ConsiderWatch(gap, w, 0, &smallest);
  // The last event so far: its time, and how that moves.
  double t = trajectory_.t_begin(), latest = 0;
  Limit order = Limit::kStart;
  for (std::size_t k = 0; k < trajectory_.arcs.size(); ++k) {
    AskBudget();
    for (const Watch& begin : begins_[k]) ConsiderWatch(begin, w, latest, &smallest);
    for (const Watch& dip : dips_[k]) ConsiderWatch(dip, w, 0, &smallest);
    efforts_->ConsiderArc(k, w, latest, &smallest);
    w = derivative_.arcs[k] * w;
    const bool last = k + 1 == trajectory_.arcs.size();
    // The grid of the input stays where it is.
    std::vector<PerturbedEvent> events;
    if (!last && derivative_.events[k].absorbed()) continue;  // with that before
    const bool changes = !last && derivative_.events[k].num_input_changes() > 0;
    if (!last && (changes || !trajectory_.transitions[k].changes_input)) {
      events = derivative_.events[k].PerturbedEvents(w);
    }
    const double first = events.empty() ? 0 : events.front().time;
    for (const Watch& end : ends_[k]) ConsiderWatch(end, w, first, &smallest);
    efforts_->ConsiderEnd(k, w, first, &smallest);
    if (last) break;
    CheckEvent(k, w, &smallest);
    const double now = derivative_.events[k].transition().t;
    Consider(now - t, first - latest, order, -1, now, &smallest);
    t = now;
    latest = events.empty() ? 0 : events.back().time;
    order = Limit::kEventOrder;
    ConsiderReturns(system_, derivative_.events[k], w, &smallest);
    const Vector after = derivative_.events[k](w);
    // Of several that are hit one after the other it is not known who bears what.
    const ConstraintSet& hit = derivative_.events[k].transition().activated;
    double time = first;
    for (const PerturbedEvent& event : events) {
      if (event.kind == PerturbedEvent::Kind::kActivation && hit.Contains(event.constraint)) {
        time = event.time;
      }
    }
    if (hit.Size() == 1) CheckImpact(k, w, after, changes ? time : first, &smallest);
    w = after;
  }
  if (order == Limit::kEventOrder) {
    Consider(trajectory_.t_end() - t, -latest, Limit::kHorizon, -1, t, &smallest);
  }
  return smallest;
}

}  // namespace contact_flow
