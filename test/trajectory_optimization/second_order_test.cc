// SPDX-License-Identifier: BSD-3-Clause
// Stationary points that are no minima: the cost falls to second order alone, and the search goes
// on from there.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "contact_flow/model/model_library.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "test/trajectory_optimization/line_problem_runs.h"

namespace contact_flow {
namespace {

/// A ball thrown up with 4.9 m/s from 1 m is at its apex, 2.225 m, after 0.5 s. It is to be at 2 m:
/// J(T) = (1 + 4.9 T − 4.9 T² − 2)² has J' = 0 and J'' = −2 · 9.8 · 0.225 there, and H = 0.
TEST(SecondOrder, TheTimeOfTheApexIsAMaximum) {
  const auto ball = MakeModel("driven_ball");
  TrajectoryProblem problem;
  problem.x = Eigen::Vector2d(1, 4.9);
  problem.inputs = {{0}, {Vector::Zero(1)}};
  problem.duration = 0.5;
  problem.choose_inputs = false;
  problem.choose_durations = {0};
  problem.effort = Vector::Zero(1);
  problem.weight = Eigen::Vector2d(1, 0);
  problem.target = Eigen::Vector2d(2, 0);
  const TrajectoryOptimum found = OptimizeTrajectory(*ball, problem);
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
  EXPECT_LT(found.cost, 1e-9);
  // 4.9 (T − T²) = 1 on either side of the apex, or at a bounce beyond 0.96 s.
  const double off = std::sqrt(0.25 - 1 / 4.9);
  if (found.duration < 0.95) {
    EXPECT_NEAR(off, std::abs(found.duration - 0.5), 1e-4);
  }
}

/// A disc that pushes another head on, so far that it ends beyond its goal: by symmetry the cost
/// does not change to first order where the push is a little off the middle; to second order it is
/// less there.
TEST(SecondOrder, APushHeadOnIsLeftSideways) {
  test::LineProblem line;
  line.mass = Eigen::Vector2d(1, 1);
  line.x = Eigen::Vector4d(-1.5, -0.8, 1, 1);
  line.duration = 1.5;
  line.count = 5;
  line.effort = 0.01;
  line.weight = Eigen::Vector4d(0, 2, 0, 1);
  line.target = Eigen::Vector4d(0, -0.6, 0, 0.4);
  const auto discs = MakeModel("two_discs", {{"wall", 0.0}});
  TrajectoryProblem problem = test::DiscsOf(line, 2);
  TrajectoryOptions options;
  options.neighbours = true;
  const TrajectoryOptimum on_line = OptimizeTrajectory(*discs, problem, options);
  problem.lower.resize(0);
  problem.upper.resize(0);
  problem.inputs = on_line.inputs;
  const TrajectoryOptimum found = OptimizeTrajectory(*discs, problem, options);
  ASSERT_TRUE(found.verdict == TrajectoryVerdict::kSmoothMinimum ||
              found.verdict == TrajectoryVerdict::kValley)
      << found.message;
  EXPECT_LT(found.cost, on_line.cost - 0.05);
  // Plain runs say the same of both.
  const Unknowns unknowns(*discs, problem);
  const auto cost = [&](const Vector& y) {
    return unknowns.Cost(y, unknowns.Run(y, 1e-12, false));
  };
  EXPECT_NEAR(found.cost, cost(found.y), 1e-9);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  int falls = 0;
  for (int i = 0; i < 40; ++i) {
    Vector sideways = Vector::Zero(found.y.size());
    for (Eigen::Index k = 0; k < sideways.size(); k += 2) sideways(k) = normal(random);
    falls += cost(on_line.y + 0.01 * sideways) < on_line.cost - 1e-9;
    const Vector d = Vector::NullaryExpr(found.y.size(), [&] { return normal(random); });
    EXPECT_GT(cost(found.y + 0.01 * d), found.cost - 1e-8);
  }
  EXPECT_GT(falls, 0);
}

}  // namespace
}  // namespace contact_flow
