// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/validity_radius.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "contact_flow/budget.h"
#include "contact_flow/derivative/variation.h"
#include "contact_flow/flow/simulate.h"
#include "guard_dips.h"

namespace contact_flow {
namespace {

using Limit = ValidityRadius::Limit;

/// Step of the difference quotient of dλ/dt, along a tangent of unit length.
constexpr double kStep = 1e-6;

/// A margin that shrinks at `rate` for every unit of α reaches zero at margin/−rate.
void Consider(double margin, double rate, Limit limit, int constraint, double t,
              ValidityRadius* smallest) {
  if (!(rate < 0)) return;
  const double radius = std::max(margin, 0.0) / -rate;
  if (radius < smallest->radius) *smallest = {radius, limit, constraint, t};
}

/// The speed with which a guard crosses zero. Where the crossing is about to vanish it does so like
/// √α, and its square like α.
void ConsiderFold(double speed, double change, Limit limit, int constraint, double t,
                  ValidityRadius* smallest) {
  Consider(speed * speed, 2 * speed * change, limit, constraint, t, smallest);
}

}  // namespace

const char* LimitName(Limit limit) {
  switch (limit) {
    case Limit::kNone:
      return "none";
    case Limit::kEventOrder:
      return "event order";
    case Limit::kStart:
      return "start";
    case Limit::kHorizon:
      return "horizon";
    case Limit::kApproachSpeed:
      return "approach speed";
    case Limit::kReleaseRate:
      return "release rate";
    case Limit::kGap:
      return "gap";
    case Limit::kForce:
      return "force";
  }
  return "unknown";
}

std::string Describe(const SystemDescription& description, const ValidityRadius& radius) {
  if (std::isnan(radius.radius)) return "not known where contacts have friction";
  const std::string name =
      radius.constraint < 0
          ? ""
          : "'" + description.constraints[static_cast<std::size_t>(radius.constraint)] + "'";
  std::ostringstream text;
  switch (radius.limit) {
    case Limit::kNone:
      return "";
    case Limit::kEventOrder:
      text << "the events before and at";
      break;
    case Limit::kStart:
      text << "an event leaves the run at its start,";
      break;
    case Limit::kHorizon:
      text << "an event" << (name.empty() ? "" : " of " + name) << " crosses the horizon,";
      break;
    case Limit::kApproachSpeed:
      text << "the touchdown of " << name << " grazes,";
      break;
    case Limit::kReleaseRate:
      text << "the release of " << name << " grazes,";
      break;
    case Limit::kGap:
      text << "the gap of " << name << " closes,";
      break;
    case Limit::kForce:
      text << "the force of " << name << " vanishes,";
      break;
  }
  text << " t = " << radius.t << " s";
  if (radius.limit == Limit::kEventOrder) text << " change places";
  return text.str();
}

ValidityEstimator::ValidityEstimator(const MechanicalSystem& system, const Trajectory& trajectory,
                                     const BDerivative& derivative)
    : system_(system), trajectory_(trajectory), derivative_(derivative) {
  if (system.HasFriction()) return;  // cones and ends of slip are not watched: nothing is known
  const std::size_t arcs = trajectory.arcs.size();
  dips_.resize(arcs);
  ends_.resize(arcs);
  for (std::size_t k = 0; k < arcs; ++k) {
    dynamics_.push_back(std::make_unique<ContactDynamics>(system, trajectory.arcs[k].u,
                                                          derivative.options.variables));
    AskBudget();
    WatchDips(k);
    WatchEnd(k);
  }
  WatchStart();
}

/// Gaps that open from the start on are smallest there.
void ValidityEstimator::WatchStart() {
  const Arc& arc = trajectory_.arcs.front();
  const int d = system_.dof(), nq = system_.num_positions();
  ConstraintTerms terms;
  system_.Constraints(arc.x_begin.head(nq), arc.x_begin.tail(d), &terms);
  for (int i = 0; i < system_.num_constraints(); ++i) {
    if (arc.mode.Contains(i) || system_.compliant().Contains(i)) continue;
    const bool touches = terms.gap(i) <= SimulateOptions().gap_tolerance;  // StartCone looks at it
    if (touches || terms.jacobian.row(i).dot(arc.x_begin.tail(d)) < 0) continue;
    Watch watch;
    watch.constraint = i;
    watch.t = arc.t_begin;
    watch.value = terms.gap(i);
    watch.gradient = GuardGradient(0, arc.x_begin, i, false);
    starts_.push_back(std::move(watch));
  }
}

/// D a_i (of the depth where it is pressed) or D λ_i at x on arc k, by (δq, δv, δu, δp).
Eigen::RowVectorXd ValidityEstimator::GuardGradient(std::size_t k, const VectorRef& x, int i,
                                                    bool is_force) const {
  ContactDynamics& dynamics = *dynamics_[k];
  const ContactMode mode = trajectory_.arcs[k].mode;
  if (is_force) {
    dynamics.Differentiate(x, mode);
    return dynamics.force_jacobian().row(i);
  }
  const double sign = (mode & system_.compliant()).Contains(i) ? -1 : 1;
  const int d = system_.dof();
  const Vector q = x.head(system_.num_positions()), v = x.tail(d);
  ConstraintTerms terms;
  system_.Constraints(q, v, &terms);
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(2 * d + dynamics.num_variables());
  row.head(d) = terms.jacobian.row(i);
  const std::vector<int>& parameters = dynamics.variables().parameters;
  if (!parameters.empty()) {
    ParameterJacobian by_parameter;
    system_.DifferentiateImpactByParameters(q, Vector::Zero(d), Vector::Zero(terms.gap.size()), v,
                                            parameters, &by_parameter);
    row.tail(static_cast<Eigen::Index>(parameters.size())) = by_parameter.gap.row(i);
  }
  return sign * row;
}

void ValidityEstimator::WatchDips(std::size_t k) {
  const Arc& arc = trajectory_.arcs[k];
  for (const GuardDip& dip : FindGuardDips(system_, arc)) {
    Arc begin = arc;
    begin.t_end = dip.t;
    begin.x_end.resize(arc.x_begin.size());
    arc.dense.Evaluate(dip.t, begin.x_end.data());
    const Matrix propagator =
        PropagateArc(dynamics_[k].get(), begin, derivative_.options.tolerance);
    Watch watch;
    watch.limit = dip.is_force ? Limit::kForce : Limit::kGap;
    watch.constraint = dip.constraint;
    watch.t = dip.t;
    watch.value = dip.value;
    watch.gradient = GuardGradient(k, begin.x_end, dip.constraint, dip.is_force) * propagator;
    dips_[k].push_back(std::move(watch));
  }
}

/// Guards that fall up to the end of the arc: there they turn, at an impact of others,
/// or the run ends.
void ValidityEstimator::WatchEnd(std::size_t k) {
  const Arc& arc = trajectory_.arcs[k];
  const bool last = k + 1 == trajectory_.arcs.size();
  ContactMode busy;
  if (!last) {
    const Transition& transition = trajectory_.transitions[k];
    busy = transition.activated | transition.switched | transition.released | transition.vanishing;
  }
  const ContactMode rigid = arc.mode - system_.compliant();
  const int d = system_.dof(), nq = system_.num_positions();
  for (int i = 0; i < system_.num_constraints(); ++i) {
    if (busy.Contains(i)) continue;
    const bool is_force = rigid.Contains(i);
    // The guard's value, and its rates to the left and to the right.
    double value = 0, before = 0, after = 0;
    if (is_force) {
      before = dynamics_[k]->ForceRate(arc.x_end, arc.mode, i);
      value = dynamics_[k]->force()(i);
      if (!last) continue;  // a force jumps at an impact: what it is afterwards counts there
    } else {
      const double sign = (arc.mode & system_.compliant()).Contains(i) ? -1 : 1;
      ConstraintTerms terms;
      system_.Constraints(arc.x_end.head(nq), arc.x_end.tail(d), &terms);
      value = sign * terms.gap(i);
      before = sign * terms.jacobian.row(i).dot(arc.x_end.tail(d));
      if (!last) {
        after = sign * terms.jacobian.row(i).dot(trajectory_.transitions[k].x_plus.tail(d));
      }
    }
    if (!(before < 0) || after < 0) continue;
    Watch watch;
    watch.limit = last ? Limit::kHorizon : Limit::kGap;
    watch.constraint = i;
    watch.t = arc.t_end;
    watch.value = value;
    watch.gradient = GuardGradient(k, arc.x_end, i, is_force);
    watch.rate = before;
    ends_[k].push_back(std::move(watch));
  }
}

/// The approach speeds and release rates of transition k, for the tangent w before it.
void ValidityEstimator::CheckEvent(std::size_t k, const Vector& w, ValidityRadius* smallest) const {
  const Transition& transition = trajectory_.transitions[k];
  const int d = system_.dof(), nq = system_.num_positions();
  ContactDynamics& dynamics = *dynamics_[k];
  const Vector q = transition.x_minus.head(nq), v = transition.x_minus.tail(d);
  const Vector field = dynamics.Field(transition.x_minus, transition.mode_before);
  ConstraintTerms terms;
  system_.Constraints(q, v, &terms);
  ResidualJacobian residual;
  system_.DifferentiateImpact(q, Vector::Zero(d), Vector::Zero(terms.gap.size()), v, &residual);
  for (int i : transition.activated) {
    const double speed = terms.jacobian.row(i).dot(v);
    const double time = -GuardGradient(k, transition.x_minus, i, false).dot(w) / speed;
    const Vector there = w + time * field;
    const double change = residual.constraint_q.row(i).dot(there.head(d)) +
                          terms.jacobian.row(i).dot(there.segment(d, d));
    ConsiderFold(speed, change, Limit::kApproachSpeed, i, transition.t, smallest);
  }
  for (int i : transition.vanishing) {
    const double rate = dynamics.ForceRate(transition.x_minus, transition.mode_before, i);
    const double time = -GuardGradient(k, transition.x_minus, i, true).dot(w) / rate;
    const Vector there = (w + time * field).head(2 * d);
    const double length = there.norm();
    if (!(length > 0)) continue;
    const Vector aside = system_.Perturb(transition.x_minus, kStep / length * there);
    const double change =
        (dynamics.ForceRate(aside, transition.mode_before, i) - rate) * length / kStep;
    ConsiderFold(rate, change, Limit::kReleaseRate, i, transition.t, smallest);
  }
}

ValidityRadius ValidityEstimator::operator()(const VectorRef& direction) const {
  ValidityRadius smallest;
  if (system_.HasFriction()) {
    smallest.radius = std::numeric_limits<double>::quiet_NaN();
    return smallest;
  }
  Vector w = Vector::Zero(derivative_.arcs.front().cols());
  w.head(direction.size()) = direction;
  const StartCone::Bound bound = derivative_.start.Limit(w);
  if (bound.constraint >= 0) {
    smallest = {bound.alpha, Limit::kGap, bound.constraint, trajectory_.t_begin()};
    if (bound.alpha == 0) return smallest;
  }
  w = derivative_.start(w);
  for (const Watch& gap : starts_) {
    Consider(gap.value, gap.gradient.dot(w), gap.limit, gap.constraint, gap.t, &smallest);
  }
  // The last event so far: its time, and how that moves.
  double t = trajectory_.t_begin(), latest = 0;
  Limit order = Limit::kStart;
  for (std::size_t k = 0; k < trajectory_.arcs.size(); ++k) {
    AskBudget();
    for (const Watch& dip : dips_[k]) {
      Consider(dip.value, dip.gradient.dot(w), dip.limit, dip.constraint, dip.t, &smallest);
    }
    w = derivative_.arcs[k] * w;
    const bool last = k + 1 == trajectory_.arcs.size();
    std::vector<PerturbedEvent> events;
    if (!last) events = derivative_.events[k].PerturbedEvents(w);
    const double first = events.empty() ? 0 : events.front().time;
    for (const Watch& end : ends_[k]) {
      Consider(end.value, end.gradient.dot(w) + end.rate * first, end.limit, end.constraint, end.t,
               &smallest);
    }
    if (last) break;
    CheckEvent(k, w, &smallest);
    const double now = trajectory_.transitions[k].t;
    Consider(now - t, first - latest, order, -1, now, &smallest);
    t = now;
    latest = events.empty() ? 0 : events.back().time;
    order = Limit::kEventOrder;
    w = derivative_.events[k](w);
  }
  if (order == Limit::kEventOrder) {
    Consider(trajectory_.t_end() - t, -latest, Limit::kHorizon, -1, t, &smallest);
  }
  return smallest;
}

}  // namespace contact_flow
