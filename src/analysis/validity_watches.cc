// SPDX-License-Identifier: BSD-3-Clause
// Where the guards of a run are least, for its radius of validity.
#include <cmath>
#include <utility>

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/derivative/variation.h"
#include "guard_dips.h"

namespace contact_flow {

using Limit = ValidityRadius::Limit;

/// Gaps that open from the start on, and depths that grow, are smallest there.
void ValidityEstimator::WatchStart() {
  const Arc& arc = trajectory_.arcs.front();
  const int d = system_.dof(), nq = system_.num_positions();
  ConstraintTerms terms;
  system_.Constraints(arc.x_begin.head(nq), arc.x_begin.tail(d), &terms);
  for (int i = 0; i < system_.num_constraints(); ++i) {
    if ((arc.mode - system_.compliant()).Contains(i)) continue;
    const double sign = arc.mode.Contains(i) ? -1 : 1;
    const double value = sign * terms.gap(i);
    const bool touches = value <= trajectory_.gap_tolerance;  // StartCone looks at it
    if (touches || sign * terms.jacobian.row(i).dot(arc.x_begin.tail(d)) < 0) continue;
    Watch watch;
    watch.constraint = i;
    watch.t = arc.t_begin;
    watch.value = value;
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

/// Forces jump at impacts and where the input changes, and those of contacts that close begin
/// there: the first value of each counts.
void ValidityEstimator::WatchBegin(std::size_t k) {
  const Arc& arc = trajectory_.arcs[k];
  for (int i : arc.mode - system_.compliant()) {
    const double rate = dynamics_[k]->ForceRate(arc.x_begin, arc.mode, i);
    if (rate < 0 && k < derivative_.events.size() &&
        derivative_.events[k].transition().vanishing.Contains(i)) {
      continue;  // the order of its release and the event before counts
    }
    Watch watch;
    watch.limit = Limit::kForce;
    watch.constraint = i;
    watch.t = arc.t_begin;
    watch.value = dynamics_[k]->force()(i);
    watch.rate = rate;
    watch.gradient = GuardGradient(k, arc.x_begin, i, true);
    begins_[k].push_back(std::move(watch));
  }
}

/// Guards at the end of the arc: there they turn at an event of others, jump, or the run ends. One
/// that is constant has its least value there, too, for what grows along the arc.
void ValidityEstimator::WatchEnd(std::size_t k) {
  const Arc& arc = trajectory_.arcs[k];
  const std::vector<EventMap>& events = derivative_.events;
  const bool last = k == events.size();
  // Gaps that are zero at the end of this arc, at its begin, at the end of the next one: there the
  // order of events counts.
  const auto meets = [&](std::size_t event) {
    return event < events.size()
               ? events[event].transition().activated | events[event].transition().switched
               : ConstraintSet();
  };
  ConstraintSet now = meets(k), vanishing;
  if (!last) {
    const Transition& transition = events[k].transition();
    now = now | transition.touching | transition.implied;
    vanishing = transition.vanishing;
  }
  const ConstraintSet before =
      k > 0 ? meets(k - 1) | events[k - 1].transition().released : ConstraintSet();
  std::size_t later = k + 1;
  while (later < events.size() && events[later].absorbed()) ++later;
  const ConstraintSet next = meets(later);
  const ConstraintSet rigid = arc.mode - system_.compliant();
  const int d = system_.dof(), nq = system_.num_positions();
  ConstraintTerms terms;
  system_.Constraints(arc.x_end.head(nq), arc.x_end.tail(d), &terms);
  for (int i = 0; i < system_.num_constraints(); ++i) {
    const bool is_force = rigid.Contains(i);
    if ((is_force ? vanishing : now).Contains(i)) continue;
    Watch watch;
    if (is_force) {
      watch.rate = dynamics_[k]->ForceRate(arc.x_end, arc.mode, i);
      watch.value = dynamics_[k]->force()(i);
    } else {
      const double sign = arc.mode.Contains(i) ? -1 : 1;
      watch.value = sign * terms.gap(i);
      watch.rate = sign * terms.jacobian.row(i).dot(arc.x_end.tail(d));
      // It touches all along, beside contacts that imply it.
      if (std::abs(watch.value) <= trajectory_.gap_tolerance &&
          std::abs(watch.rate) <= trajectory_.speed_tolerance) {
        continue;
      }
      if (watch.rate > 0 && before.Contains(i)) continue;
      if (watch.rate < 0 && next.Contains(i)) continue;
    }
    watch.limit = last ? Limit::kHorizon : is_force ? Limit::kForce : Limit::kGap;
    watch.constraint = i;
    watch.t = arc.t_end;
    watch.gradient = GuardGradient(k, arc.x_end, i, is_force);
    ends_[k].push_back(std::move(watch));
  }
}

}  // namespace contact_flow
