// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/model/model_library.h"
#include "contact_flow/trajectory_optimization/problem.h"
#include "test/trajectory_optimization/line_problem.h"

namespace contact_flow {
namespace test {

/// The same problem of `driven_ball` (one body) from inputs u on all intervals.
inline TrajectoryProblem BallOf(const LineProblem& line, double u) {
  TrajectoryProblem problem;
  problem.x = line.x;
  problem.duration = line.duration;
  for (int k = 0; k < line.count; ++k) {
    problem.inputs.grid.push_back(line.duration * k / line.count);
    problem.inputs.values.push_back(Vector::Constant(1, u));
  }
  problem.linear_inputs = line.linear;
  problem.effort = Vector::Constant(1, line.effort);
  problem.weight = line.weight;
  problem.target = line.target;
  return problem;
}

/// The same problem of `two_discs` with centres on the line x = 0, the first disc below: the bodies
/// of the line are their centres. Nothing pushes across it: past the middle may cost less.
inline TrajectoryProblem DiscsOf(const LineProblem& line, double u) {
  TrajectoryProblem problem = BallOf(line, u);
  const auto spread = [](const Vector& values) {
    Vector all = Vector::Zero(8);
    for (int i = 0; i < 4; ++i) all(2 * i + 1) = values(i);
    return all;
  };
  for (Vector& value : problem.inputs.values) value = Eigen::Vector2d(0, u);
  problem.effort = Eigen::Vector2d(line.effort, line.effort);
  problem.x = spread(line.x);
  problem.weight = spread(line.weight);
  problem.target = spread(line.target);
  constexpr double kFree = std::numeric_limits<double>::infinity();
  problem.lower = Eigen::Vector2d(0, -kFree);
  problem.upper = Eigen::Vector2d(0, kFree);
  return problem;
}

}  // namespace test
}  // namespace contact_flow
