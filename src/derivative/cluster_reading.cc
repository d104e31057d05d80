// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/cluster_reading.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace contact_flow {
namespace {

/// First-order times that differ by less than this, relative, coincide.
constexpr double kTie = 1e-8;

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

}  // namespace

ClusterReading ReadClusters(const BDerivative& derivative, const VectorRef& w) {
  ClusterReading reading;
  Vector tangent = derivative.arcs.front() * derivative.Begin(w), in_order = tangent;
  for (std::size_t k = 0; k < derivative.events.size(); ++k) {
    const EventMap& map = derivative.events[k];
    const std::vector<EventInstant> instants = InOrder(map.transition(), map);
    const bool merged = instants.size() > 1 && instants.size() == map.activated().size();
    if (merged) {
      std::vector<int> order;
      for (const EventInstant& instant : instants) order.push_back(instant.constraint);
      const Vector times = map.Times(order) * tangent;
      for (std::size_t i = 0; i + 1 < order.size(); ++i) {
        const auto row = static_cast<Eigen::Index>(i);
        const double closing = times(row) - times(row + 1);
        const double size = std::abs(times(row)) + std::abs(times(row + 1));
        if (!(closing > kTie * size)) continue;
        const double apart = std::max(instants[i + 1].offset - instants[i].offset,
                                      instants[i].error + instants[i + 1].error);
        reading.inner_radius = std::max(reading.inner_radius, apart / closing);
      }
      if (map.PiecewiseLinear(order).ok()) {
        in_order = map.Selection(order) * in_order;
      } else {
        in_order.setConstant(std::numeric_limits<double>::quiet_NaN());
      }
    } else if (in_order.allFinite()) {
      in_order = map(in_order);
    }
    tangent = derivative.arcs[k + 1] * map(tangent);
    in_order = derivative.arcs[k + 1] * in_order;
  }
  reading.in_order = in_order.head(derivative.time.size());
  return reading;
}

}  // namespace contact_flow
