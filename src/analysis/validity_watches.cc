// SPDX-License-Identifier: BSD-3-Clause
// Where the guards of a run are least, for its radius of validity.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "contact_flow/analysis/validity_radius.h"
#include "departures.h"
#include "guard_dips.h"
#include "propagator_along.h"
#include "src/dynamics/guard_gradients.h"

namespace contact_flow {

using Limit = ValidityRadius::Limit;

/// Gaps that open from the start on, and depths that grow, are smallest there.
void ValidityEstimator::WatchStart() {
  const Arc& arc = trajectory_.arcs.front();
  const Guards guards(system_);
  for (int i : guards.OfGaps(arc.mode)) {
    const GuardJet at = guards.At(i, dynamics_[0].get(), arc.x_begin, arc.mode);
    const bool touches = at.value <= trajectory_.gap_tolerance;  // StartCone looks at it
    if (touches || at.rate < 0) continue;
    Watch watch;
    watch.constraint = i;
    watch.t = arc.t_begin;
    watch.value = at.value;
    watch.gradient = GuardGradient(0, arc.x_begin, i);
    starts_.push_back(std::move(watch));
  }
}

/// Dh of a guard at x on arc k, by (δq, δv, δu, δp).
Eigen::RowVectorXd ValidityEstimator::GuardGradient(std::size_t k, const VectorRef& x,
                                                    int guard) const {
  return GuardGradients(dynamics_[k].get(), x, trajectory_.arcs[k].mode).At(guard).gradient;
}

void ValidityEstimator::WatchDips(std::size_t k) {
  const Arc& arc = trajectory_.arcs[k];
  std::vector<GuardDip> dips = FindGuardDips(system_, arc, trajectory_.gap_tolerance);
  if (dips.empty()) return;
  std::sort(dips.begin(), dips.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
  PropagatorAlong along(dynamics_[k].get(), arc, derivative_.options.tolerance);
  for (const GuardDip& dip : dips) {
    const Matrix& propagator = along.To(dip.t);
    Watch watch;
    watch.limit = dip.is_force ? Limit::kForce : Limit::kGap;
    watch.constraint = dip.constraint;
    watch.t = dip.t;
    watch.value = dip.value;
    watch.gradient = GuardGradient(k, along.x(), dip.constraint) * propagator;
    dips_[k].push_back(std::move(watch));
  }
}

/// Forces jump at impacts and where the input changes, and those of contacts that close begin
/// there: the first value of each counts. So does what lifts a contact from there on.
void ValidityEstimator::WatchBegin(std::size_t k) {
  const Arc& arc = trajectory_.arcs[k];
  const Guards guards(system_);
  for (int i : guards.OfForces(arc.mode, {})) {
    const GuardJet at = guards.At(i, dynamics_[k].get(), arc.x_begin, arc.mode);
    if (at.rate < 0 && k < derivative_.events.size() &&
        derivative_.events[k].transition().vanishing.Contains(i)) {
      continue;  // the order of its release and the event before counts
    }
    Watch watch;
    watch.limit = Limit::kForce;
    watch.constraint = i;
    watch.t = arc.t_begin;
    watch.value = at.value;
    watch.rate = at.rate;
    watch.gradient = GuardGradient(k, arc.x_begin, i);
    begins_[k].push_back(std::move(watch));
  }
  for (const Departure& of : FindDepartures(dynamics_[k].get(), trajectory_, derivative_, k)) {
    begins_[k].push_back(
        {Limit::kReleaseRate, of.constraint, arc.t_begin, of.value, of.gradient, of.rate});
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
  const Guards guards(system_);
  const GuardGradients gradients(dynamics_[k].get(), arc.x_end, arc.mode);
  for (int i = 0; i < system_.num_constraints(); ++i) {
    const bool is_force = IsOfForces(guards.KindOf(i, arc.mode));
    if ((is_force ? vanishing : now).Contains(i)) continue;
    const GuardJet at = guards.At(i, dynamics_[k].get(), arc.x_end, arc.mode);
    Watch watch;
    watch.value = at.value;
    watch.rate = at.rate;
    if (!is_force) {
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
    watch.gradient = gradients.At(i).gradient;
    ends_[k].push_back(std::move(watch));
  }
}

}  // namespace contact_flow
