// SPDX-License-Identifier: BSD-3-Clause
#include "src/derivative/propagation_errors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

/// Steps that double what they act on, the k-th of them turned by k.
Matrix TurningStep(int k) {
  Matrix step(2, 2);
  step << std::cos(k), -std::sin(k), std::sin(k), std::cos(k);
  return step;
}

TEST(ArcParts, AreTheArcWhateverTheNumberOfSteps) {
  for (const int steps : {1, 8, 9, 16, 63, 64, 65, 500}) {
    ArcParts parts;
    Matrix phi = Matrix::Identity(2, 2);
    for (int k = 0; k < steps; ++k) {
      const Matrix step = TurningStep(k);
      phi = step * phi;
      parts.Add(k, k + 1, step, phi);
    }
    const std::vector<ArcPart> all = parts.Take(0, steps, phi);
    ASSERT_LE(all.size(), ArcParts::kMost);
    EXPECT_EQ(steps > 8, all.size() > 1) << steps;
    Matrix product = Matrix::Identity(2, 2);
    double t = 0;
    for (const ArcPart& part : all) {
      EXPECT_EQ(t, part.t_begin) << steps;
      t = part.t_end;
      product = part.phi * product;
    }
    EXPECT_EQ(steps, t);
    EXPECT_LT((product - phi).cwiseAbs().maxCoeff(), 1e-12) << steps;
  }
}

/// A robot whose base turns, and whose feet slip: the parts are propagators of (δq, δv), which
/// where velocities are those of a body are not those of (δq, δq̇).
TEST(PropagationErrors, HavePartsThatMakeThePropagator) {
  const auto robot = LoadRobot(RobotFile("quadruped_friction"));
  Vector x = robot->nominal().x;
  x.segment(robot->num_positions(), 6) << 0.5, -0.4, 0, 0.3, -0.2, 0.1;
  SimulateOptions options = test::AtTolerance(1e-9);
  options.dense = true;
  const Trajectory run = Simulate(*robot, x, robot->nominal().u, 0.05, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ContactDynamics dynamics(*robot, robot->nominal().u);
  std::size_t most = 0;
  for (const Arc& arc : run.arcs) {
    PropagationErrors errors;
    VariationStatistics statistics;
    const Matrix phi = PropagateArc(&dynamics, arc, 1e-12, &statistics, &errors);
    if (errors.parts.empty()) continue;
    Matrix product = Matrix::Identity(phi.rows(), phi.cols());
    for (const ArcPart& part : errors.parts) product = part.phi * product;
    EXPECT_LT((product - phi).cwiseAbs().maxCoeff(), 1e-8 * phi.cwiseAbs().maxCoeff());
    most = std::max(most, errors.parts.size());
    EXPECT_LE(errors.relative, statistics.error_estimate);
  }
  EXPECT_GT(most, 1u);
}

}  // namespace
}  // namespace contact_flow
