// SPDX-License-Identifier: BSD-3-Clause
#include "effort_watches.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/model/effort_limits.h"
#include "propagator_along.h"
#include "resolved_instants.h"
#include "validity_margins.h"

namespace contact_flow {
namespace {

constexpr int kThirds = 60;        // of what holds a turn: down to rounding
constexpr double kAtLimit = 1e-9;  // a share this near to a limit passes it there
/// Half the distance of a difference quotient, for an input beside max(1, |u|); rounding of r.
constexpr double kAsideShare = 1e-6, kShareRounding = 1e-9;

/// Where sign·share(t) is least within (left, right).
template <class Share>
double TurnOf(const Share& share, double sign, double left, double right) {
  for (int k = 0; k < kThirds; ++k) {
    const double third = (right - left) / 3;
    if (sign * share(left + third) < sign * share(right - third)) {
      right -= third;
    } else {
      left += third;
    }
  }
  return left + (right - left) / 2;
}

}  // namespace

EffortWatches::EffortWatches(const MechanicalSystem& system, const Trajectory& trajectory,
                             const BDerivative& derivative)
    : system_(system), trajectory_(trajectory), derivative_(derivative), functions_(system) {
  if (functions_.num_efforts() == 0) return;
  const std::size_t arcs = trajectory.arcs.size();
  begins_.resize(arcs);
  turns_.resize(arcs);
  ends_.resize(arcs);
  for (std::size_t k = 0; k < arcs; ++k) {
    // An arc inside a cluster has no length.
    if (k < derivative.events.size() && derivative.events[k].absorbed()) continue;
    begins_[k] = At(k, trajectory.arcs[k].t_begin);
    ends_[k] = At(k, trajectory.arcs[k].t_end);
    WatchTurns(k);
  }
}

/// All shares at t on arc k, by tangents there.
std::vector<EffortWatches::Watch> EffortWatches::At(std::size_t k, double t) const {
  const Arc& arc = trajectory_.arcs[k];
  const int d = system_.dof(), m = static_cast<int>(arc.u.size());
  const auto inputs = derivative_.options.variables.inputs ? m : 0;
  const auto shares = [&](const Vector& x, const Vector& u) {
    Vector all;
    functions_.Evaluate(x, u, arc.mode, &all);
    return Vector(all.head(functions_.num_efforts()));
  };
  Vector x = arc.x_begin;
  const auto at = [&](double instant) {
    if (instant == arc.t_begin) return arc.x_begin;
    if (instant == arc.t_end) return arc.x_end;
    arc.dense.Evaluate(instant, x.data());
    return x;
  };
  const Vector here = at(t), value = shares(here, arc.u);
  Matrix gradient = Matrix::Zero(value.size(), derivative_.arcs[k].cols());
  for (int j = 0; j < 2 * d; ++j) {
    const Vector aside = kAsideShare * Vector::Unit(2 * d, j);
    gradient.col(j) = (shares(system_.Perturb(here, aside), arc.u) -
                       shares(system_.Perturb(here, -aside), arc.u)) /
                      (2 * kAsideShare);
  }
  for (int j = 0; j < inputs; ++j) {
    const double size = kAsideShare * std::max(1.0, std::abs(arc.u(j)));
    const Vector aside = size * Vector::Unit(m, j);
    gradient.col(2 * d + j) =
        (shares(here, arc.u + aside) - shares(here, arc.u - aside)) / (2 * size);
  }
  const double length = kAsideShare * (arc.t_end - arc.t_begin);
  const double from = std::max(arc.t_begin, t - length), to = std::min(arc.t_end, t + length);
  const Vector rate = (shares(at(to), arc.u) - shares(at(from), arc.u)) / (to - from);
  std::vector<Watch> watches;
  for (int i = 0; i < functions_.num_efforts(); ++i) {
    if (!std::isfinite(value(i)) || !gradient.row(i).allFinite()) continue;
    watches.push_back({i, t, value(i), std::isfinite(rate(i)) ? rate(i) : 0, gradient.row(i)});
  }
  return watches;
}

/// The shares where they turn, by tangents at the begin of the arc.
void EffortWatches::WatchTurns(std::size_t k) {
  const Arc& arc = trajectory_.arcs[k];
  if (arc.dense.Empty()) return;  // without length
  Vector x = arc.x_begin, all;
  const auto shares = [&](double t) -> const Vector& {
    arc.dense.Evaluate(t, x.data());
    functions_.Evaluate(x, arc.u, arc.mode, &all);
    return all;
  };
  const double length = kAsideShare * (arc.t_end - arc.t_begin);
  const auto sample = [&](double t) {
    const Vector here = shares(t);
    const double aside = t + length > arc.t_end ? -length : length;
    const Vector rate = (shares(t + aside) - here) / aside;
    return GuardSample{here, rate, Vector::Constant(here.size(), kShareRounding)};
  };
  const std::vector<double> times = ResolvedInstants(arc, sample);
  std::vector<std::pair<double, int>> turns;
  Vector fall;  // in the piece before
  Vector left = shares(times[0]);
  for (std::size_t p = 1; p < times.size(); ++p) {
    AskBudget();
    const Vector right = shares(times[p]), rise = right - left;
    for (int i = 0; p > 1 && i < functions_.num_efforts(); ++i) {
      if (!(fall(i) * rise(i) < 0)) continue;
      if (std::max(std::abs(fall(i)), std::abs(rise(i))) <= kShareRounding) continue;  // at rest
      const auto share = [&](double t) { return shares(t)(i); };
      turns.emplace_back(TurnOf(share, fall(i) < 0 ? 1 : -1, times[p - 2], times[p]), i);
    }
    left = right;
    fall = rise;
  }
  if (turns.empty()) return;
  std::sort(turns.begin(), turns.end());
  ContactDynamics dynamics(system_, arc.u, derivative_.options.variables);
  PropagatorAlong along(&dynamics, arc, derivative_.options.tolerance);
  for (const auto& [t, effort] : turns) {
    const Matrix& propagator = along.To(t);
    for (Watch& watch : At(k, t)) {
      if (watch.effort != effort) continue;
      watch.gradient = watch.gradient * propagator;
      turns_[k].push_back(std::move(watch));
    }
  }
}

/// α at which the share of a watch is at one of its limits, for the tangent w at its place, whose
/// instant moves by `shift` for every unit of α.
void EffortWatches::Consider(const Watch& watch, const Vector& w, double shift,
                             ValidityRadius* smallest) const {
  const double change = watch.gradient.dot(w) + watch.rate * shift;
  const double terms = watch.gradient.cwiseAbs().dot(w.cwiseAbs()) + std::abs(watch.rate * shift);
  if (!(std::abs(change) > kShareRounding * (terms + w.cwiseAbs().maxCoeff()))) return;
  for (const double limit : functions_.corners(watch.effort)) {
    const double margin = std::abs(watch.value - limit);
    if (margin <= kAtLimit || (limit - watch.value) * change <= 0) continue;
    const double before = smallest->radius;
    contact_flow::Consider(margin, -std::abs(change), ValidityRadius::Limit::kEffort, -1, watch.t,
                           smallest);
    if (smallest->radius < before) {
      const auto& names = dynamic_cast<const EffortLimits&>(system_).limited_efforts();
      smallest->effort = names[static_cast<std::size_t>(watch.effort)];
    }
  }
}

void EffortWatches::ConsiderArc(std::size_t k, const Vector& w, double shift,
                                ValidityRadius* smallest) const {
  if (functions_.num_efforts() == 0) return;
  for (const Watch& begin : begins_[k]) Consider(begin, w, shift, smallest);
  for (const Watch& turn : turns_[k]) Consider(turn, w, 0, smallest);
}

void EffortWatches::ConsiderEnd(std::size_t k, const Vector& w, double shift,
                                ValidityRadius* smallest) const {
  if (functions_.num_efforts() == 0) return;
  for (const Watch& end : ends_[k]) Consider(end, w, shift, smallest);
}

}  // namespace contact_flow
