// SPDX-License-Identifier: BSD-3-Clause
// A minimum within bounds is one: the cost, summed up here, falls along no direction that the
// bounds leave.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"

namespace contact_flow {
namespace {

/// Two bars that swing against a wall; few inputs, which their weights leave free, within bounds.
struct Swing {
  std::unique_ptr<MechanicalSystem> system;
  TrajectoryProblem problem;

  Swing() : system(MakeModel("double_pendulum", {{"restitution", 0.373}})) {
    problem.x = system->nominal().x;
    problem.duration = 0.88547184581241456;
    problem.inputs.grid = {0, 0.18664531803347426, 0.32949761553043555, 0.53381483754928927,
                           0.71040381356134941};
    const double guess[5][2] = {{0.374, 0.811}, {-0.160, 0}, {0, 0.253}, {0, -0.0607}, {0, 0}};
    for (const auto& u : guess) problem.inputs.values.push_back(Eigen::Vector2d(u[0], u[1]));
    problem.effort = Vector::Zero(2);
    problem.weight = Eigen::Vector4d(0, 0, 4.29995, 0.357853);
    problem.target = Eigen::Vector4d(0.776527, 0.820381, -0.528697, 1.193948);
    problem.path_weight = Eigen::Vector2d(0.272248, 0.100259);
    problem.path_target = Eigen::Vector2d(0.116942, 1.166866);
    problem.lower = Vector::Constant(2, -6.026187);
    problem.upper = Vector::Constant(2, 6.769078);
    problem.choose_initial = {2};
    problem.initial_lower = Vector::Constant(1, -0.333796);
    problem.initial_upper = Vector::Constant(1, 0.449263);
  }

  double Cost(const Vector& x, const InputSchedule& inputs) const {
    SimulateOptions options = problem.simulate;
    options.dense = true;
    const Trajectory run = Simulate(*system, x, inputs, problem.duration, options);
    double cost = 0;
    for (std::size_t k = 0; k < inputs.grid.size(); ++k) {
      const bool last = k + 1 == inputs.grid.size();
      const double end = last ? problem.duration : inputs.grid[k + 1];
      const Vector there = last ? run.FinalState() : Vector(run.State(end));
      const Vector apart = there.head(2) - problem.path_target;
      cost += (end - inputs.grid[k]) * problem.path_weight.dot(apart.cwiseAbs2());
    }
    return cost + problem.weight.dot((run.FinalState() - problem.target).cwiseAbs2());
  }
};

TEST(TrajectoryBounds, NoDirectionWithinThemLowersTheCost) {
  const Swing swing;
  TrajectoryOptions options;
  options.max_iterations = 300;
  const TrajectoryOptimum best = OptimizeTrajectory(*swing.system, swing.problem, options);
  ASSERT_EQ(TrajectoryVerdict::kSmoothMinimum, best.verdict) << best.message;
  EXPECT_LT(best.hull_distance, 1e-3);
  for (const PieceProof& proof : best.certificate) EXPECT_GE(proof.decrease, 0);
  const double least = swing.Cost(best.x, best.inputs), step = 1e-3;
  EXPECT_NEAR(best.cost, least, 1e-7);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  int bounded = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Vector x = best.x;
    InputSchedule inputs = best.inputs;
    // Several directions lie in a few entries alone.
    const auto move = [&](double value, double lower, double upper) {
      const double w = trial % 2 == 0 || normal(random) > 1 ? normal(random) : 0;
      bounded += value == lower || value == upper;
      return std::clamp(value + step * w, lower, upper);
    };
    for (Vector& u : inputs.values) {
      for (int k = 0; k < 2; ++k) {
        u(k) = move(u(k), swing.problem.lower(k), swing.problem.upper(k));
      }
    }
    x(2) = move(x(2), swing.problem.initial_lower(0), swing.problem.initial_upper(0));
    EXPECT_GT(swing.Cost(x, inputs), least - 1e-3 * step) << "trial " << trial;
  }
  EXPECT_GT(bounded, 0);
}

}  // namespace
}  // namespace contact_flow
