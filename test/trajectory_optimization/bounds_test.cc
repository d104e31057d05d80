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

/// Bounds that are equal hold what they bound, whatever rounding says: the disc that pushes another
/// has no force across.
TEST(TrajectoryBounds, EqualOnesHoldBesideAContact) {
  const std::unique_ptr<MechanicalSystem> discs = MakeModel("two_discs", {{"wall", 0.5}});
  TrajectoryProblem problem;
  problem.x.resize(8);
  problem.x << -0.95, -2, -1, -1, 0, 0, 0, 0;
  problem.duration = 1;
  problem.effort = Vector::Constant(2, 0.05);
  problem.weight = problem.target = Vector::Zero(8);
  problem.weight.head(4) << 0, 1, 1, 1;
  problem.target.head(4) << 0, -1.5, -0.8, 0;
  const double half = 1e-9;
  const double starts[3][5] = {
      {0.65, 7.0, 7.53, 2.09, 0.1}, {3.86, 1.46, 7.77, 7.18, 7.69}, {4.83, 4.12, 6.66, 5.22, 1.99}};
  for (const auto& forces : starts) {
    problem.inputs = {};
    for (int k = 0; k < 5; ++k) {
      problem.inputs.grid.push_back(k / 5.0);
      problem.inputs.values.push_back(Eigen::Vector2d(0, forces[k]));
    }
    problem.lower = Eigen::Vector2d(-half, -20);
    problem.upper = Eigen::Vector2d(half, 20);
    const TrajectoryOptimum open = OptimizeTrajectory(*discs, problem);
    problem.lower(0) = problem.upper(0) = 0;
    const TrajectoryOptimum held = OptimizeTrajectory(*discs, problem);
    ASSERT_EQ(TrajectoryVerdict::kValley, held.verdict) << held.message;
    EXPECT_EQ(TrajectoryVerdict::kValley, open.verdict) << open.message;
    EXPECT_NEAR(open.cost, held.cost, 1e-7);
    for (const Vector& u : held.inputs.values) EXPECT_EQ(0, u(0));
  }
}

}  // namespace
}  // namespace contact_flow
