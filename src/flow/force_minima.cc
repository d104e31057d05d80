// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/force_minima.h"

#include <algorithm>
#include <cmath>

#include "step_constants.h"

namespace contact_flow {
namespace {

/// Of a quintic at the beginning of a step, whose first coefficients tell it, beside its range.
constexpr double kSlopeError = 1e-3;

/// The lowest value of the parabola through the nodes k − 1, k, k + 1, the middle one the lowest;
/// the middle value where a force that varies as much is searched.
double Lowest(const StagePlaces& places, const ForceMinima::Values& values, int k) {
  const double highest = *std::max_element(values.begin(), values.end());
  if (values[k] <= kForceMargin * (highest - values[k])) return values[k];
  const auto at = [&](int node) { return places.at[places.nodes[node]]; };
  const double left = at(k) - at(k - 1), right = at(k + 1) - at(k);
  const double fall = (values[k] - values[k - 1]) / left;
  const double rise = (values[k + 1] - values[k]) / right;
  const double bend = (rise - fall) / (left + right);
  const double slope = (fall * right + rise * left) / (left + right);
  return bend > 0 ? values[k] - slope * slope / (4 * bend) : values[k];
}

/// Whether the quintic through the nodes falls where the step begins, by more than it may be off
/// and by more than noise.
bool FallsAtBegin(const StagePlaces& places, const ForceMinima::Values& values, double noise) {
  const auto nodes = Eigen::Map<const Eigen::Matrix<double, StagePlaces::kNodes, 1>>(values.data());
  const double slope = places.bernstein.row(1).dot(nodes) - values[0];
  return slope < -std::max(noise, kSlopeError * (nodes.maxCoeff() - nodes.minCoeff()));
}

}  // namespace

void ForceMinima::Pass(int g, const StagePlaces& places, const Values& values,
                       double relative_noise) {
  constexpr int kLast = StagePlaces::kNodes - 1;
  Guard& guard = guards_[static_cast<std::size_t>(g)];
  double extreme = guard.way == Way::kNone ? values[0] : guard.extreme;
  largest_ = std::max(largest_, std::abs(values[0]));
  const double noise = std::max(relative_noise * largest_, kForceNoise * std::abs(extreme));
  bool falling = guard.way == Way::kFalls;
  int lowest_node = 0;
  // A force may fall to its minimum before the first node.
  const bool turns = guard.begins && FallsAtBegin(places, values, noise);
  for (int k = 0; k <= kLast; ++k) {
    const double value = values[k];
    if (falling ? value < extreme : value > extreme) {
      extreme = value;
      lowest_node = k;
    } else if (falling && value > extreme + noise) {
      if (lowest_node > 0) extreme = Lowest(places, values, lowest_node);
      lowest_ = std::min(lowest_, extreme);
      falling = false;
      extreme = value;
    } else if (!falling && value < extreme - noise) {
      falling = true;
      extreme = value;
      lowest_node = k;
    }
    if (k == 0 && turns && !falling) {
      falling = true;
      extreme = value;
    }
  }
  guard = {falling ? Way::kFalls : Way::kRises, false, extreme};
}

}  // namespace contact_flow
