// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/cluster_reading.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace contact_flow {
namespace {

/// First-order times that differ by less than this, relative, coincide; and derivatives.
constexpr double kReadingTie = 1e-8, kSameReading = 1e-9;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// The activations of a transition, and what the run knows of their instants, in that order.
std::vector<EventInstant> InOrder(const Transition& transition, const EventMap& map) {
  std::vector<EventInstant> instants;
  for (const EventInstant& instant : transition.instants) {
    const std::vector<int>& known = map.activated();
    if (std::find(known.begin(), known.end(), instant.constraint) != known.end()) {
      instants.push_back(instant);
    }
  }
  std::stable_sort(
      instants.begin(), instants.end(),
      [](const EventInstant& a, const EventInstant& b) { return a.offset < b.offset; });
  return instants;
}

std::vector<int> Constraints(const std::vector<EventInstant>& instants) {
  std::vector<int> constraints;
  for (const EventInstant& instant : instants) constraints.push_back(instant.constraint);
  return constraints;
}

/// The α beyond which events of a cluster are in the order of their τ along a tangent: where
///   t_i + α τ_i ≤ t_j + α τ_j
/// for all pairs, whatever their instants are within their errors. Only pairs that have another
/// order in the run count, and those whose order errors leave unknown, where it matters.
double InnerRadius(const std::vector<EventInstant>& instants, const Vector& times) {
  double radius = 0;
  for (std::size_t i = 0; i < instants.size(); ++i) {
    for (std::size_t j = i + 1; j < instants.size(); ++j) {
      const double tau_i = times(static_cast<Eigen::Index>(i)),
                   tau_j = times(static_cast<Eigen::Index>(j));
      const double closing = tau_i - tau_j, apart = instants[j].offset - instants[i].offset;
      const double error = instants[i].error + instants[j].error;
      if (!(std::abs(closing) > kReadingTie * (std::abs(tau_i) + std::abs(tau_j)))) continue;
      const double late = closing > 0 ? std::max(apart, error) : error - apart;
      if (late > 0) radius = std::max(radius, late / std::abs(closing));
    }
  }
  return radius;
}

/// The same with friction, by what the run along the tangent meets; 0 where all pieces are one.
double FrictionalRadius(const EventMap& map, const Vector& tangent) {
  const EventPiece piece = map.PieceAlong(tangent);
  const Vector moved = piece.times * tangent;
  std::vector<std::pair<EventInstant, double>> met;
  for (const EventInstant& instant : map.transition().instants) {
    const auto place = std::find(piece.order.begin(), piece.order.end(), instant.constraint);
    if (place != piece.order.end()) met.push_back({instant, moved(place - piece.order.begin())});
  }
  std::stable_sort(met.begin(), met.end(),
                   [](const auto& a, const auto& b) { return a.first.offset < b.first.offset; });
  std::vector<EventInstant> instants;
  Vector times(static_cast<Eigen::Index>(met.size()));
  for (const auto& [instant, time] : met) {
    times(static_cast<Eigen::Index>(instants.size())) = time;
    instants.push_back(instant);
  }
  const double radius = InnerRadius(instants, times);
  return radius > 0 && !map.IsDifferentiable(kSameReading) ? radius : 0;
}

/// Whether the order of the instants, or one that their errors leave possible, has another
/// derivative than `derivative`, that along the order of the τ.
bool OrderMatters(const EventMap& map, const std::vector<EventInstant>& instants,
                  const Vector& tangent, const Vector& derivative) {
  const auto differs = [&](const std::vector<int>& order) {
    if (!map.PiecewiseLinear(order).ok()) return true;
    const Vector other = map.Selection(order) * tangent;
    return (other - derivative).cwiseAbs().maxCoeff() >
           kSameReading * (1 + derivative.cwiseAbs().maxCoeff());
  };
  const std::vector<int> order = Constraints(instants);
  if (differs(order)) return true;
  for (std::size_t i = 0; i + 1 < order.size(); ++i) {
    const double error = instants[i].error + instants[i + 1].error;
    if (instants[i + 1].offset - instants[i].offset > error) continue;
    std::vector<int> exchanged = order;
    std::swap(exchanged[i], exchanged[i + 1]);
    if (differs(exchanged)) return true;
  }
  return false;
}

}  // namespace

ClusterReading ReadClusters(const BDerivative& derivative, const VectorRef& w) {
  ClusterReading reading;
  reading.inner_radius = derivative.start.InnerRadius(w);
  Vector tangent = derivative.Along(0, derivative.Begin(w)), in_order = tangent;
  if (reading.inner_radius > 0) {
    in_order = derivative.arcs.front() * derivative.start.Unturned(w);
  }
  for (std::size_t k = 0; k < derivative.events.size(); ++k) {
    const EventMap& map = derivative.events[k];
    const std::vector<EventInstant> instants = InOrder(map.transition(), map);
    const bool merged = instants.size() > 1 && instants.size() == map.activated().size();
    const Vector after = map(tangent);
    if (merged) {
      const std::vector<int> order = Constraints(instants);
      const double radius = InnerRadius(instants, map.Times(order) * tangent);
      if (radius > reading.inner_radius && OrderMatters(map, instants, tangent, after)) {
        reading.inner_radius = radius;
      }
      if (map.PiecewiseLinear(order).ok()) {
        in_order = map.Selection(order) * in_order;
      } else {
        in_order.setConstant(kUnknown);
      }
    } else {
      const bool frictional =
          !map.transition().guards.empty() && map.transition().instants.size() > 1;
      const double radius = frictional ? FrictionalRadius(map, tangent) : 0;
      reading.inner_radius = std::max(reading.inner_radius, radius);
      if (radius > 0) in_order.setConstant(kUnknown);
      if (in_order.allFinite()) in_order = map(in_order);
    }
    tangent = derivative.Along(k + 1, after);
    in_order = derivative.arcs[k + 1] * in_order;
  }
  reading.in_order = in_order.head(derivative.time.size());
  return reading;
}

}  // namespace contact_flow
