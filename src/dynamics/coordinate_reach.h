// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "contact_flow/model/configuration_space.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// No size of a coordinate is less, as what is added to it in kinematics is that large.
inline double LeastReach(const VectorRef& q) { return std::min(1.0, q.cwiseAbs().maxCoeff()); }

/// How large each coordinate is where it is asked what a function of them is known to, along
/// tangents [d]: |q_k|, but no less than min(1, |q|∞), which is that of turns of a rotation. One
/// that is far away tells nothing of the others.
inline Vector CoordinateReach(const ConfigurationSpace& space, const VectorRef& q) {
  const double least = LeastReach(q);
  if (space.IsFlat()) return q.cwiseAbs().cwiseMax(least);
  Vector reach = Vector::Constant(space.dof(), least);
  const std::vector<int>& lines = space.line_velocities();
  for (std::size_t k = 0; k < lines.size(); ++k) {
    if (lines[k] < 0) continue;
    double& of = reach(lines[k]);
    of = std::max(of, std::abs(q(static_cast<Eigen::Index>(k))));
  }
  return reach;
}

/// Σ_k |row_k| reach_k: how large the terms of a gap with this gradient are.
template <class Row>
double ReachAlong(const Row& row, const ConfigurationSpace& space, const VectorRef& q) {
  const double least = LeastReach(q);
  const std::vector<int>& lines = space.line_velocities();
  double sum = 0;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    if (lines[k] < 0) continue;
    sum += std::abs(row(lines[k])) * std::max(least, std::abs(q(static_cast<Eigen::Index>(k))));
  }
  for (const ConfigurationSpace::Rotation& turn : space.rotations()) {
    for (int j = 0; j < 3; ++j) sum += std::abs(row(turn.v + j)) * least;
  }
  return sum;
}

/// How long x moves along this field [2d] until one of its numbers has changed by 1 and its size
/// [s]: one that is far away, or hardly moves, does not make it longer for the others.
inline double TimeToMove(const ConfigurationSpace& space, const VectorRef& x,
                         const VectorRef& field) {
  const int d = space.dof();
  const Vector far = CoordinateReach(space, x.head(space.num_positions()));
  double fastest = 1e-300;
  for (int k = 0; k < d; ++k) {
    const double speed = std::abs(x(x.size() - d + k));
    fastest = std::max(
        {fastest, std::abs(field(k)) / (1 + far(k)), std::abs(field(d + k)) / (1 + speed)});
  }
  return 1 / fastest;
}

}  // namespace contact_flow
