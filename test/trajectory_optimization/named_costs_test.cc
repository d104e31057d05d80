// SPDX-License-Identifier: BSD-3-Clause
// Power on the way and impulses at events as costs: closed forms, one-sided quotients of plain runs
// (error of first order in the step) at points where a touchdown coincides with a change of the
// input and elsewhere, minima that are none but minima.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "src/dynamics/impulse_jacobian.h"
#include "test/derivative/input_cases.h"
#include "test/trajectory_optimization/cost_at.h"
#include "test/trajectory_optimization/driven_ball.h"

namespace contact_flow {
namespace {

using test::CostAt;
using test::kBallGravity;
using test::kBallRestitution;

TrajectoryProblem ProblemOfBall(const std::vector<double>& grid, double u) {
  TrajectoryProblem problem;
  problem.x = Eigen::Vector2d(1, 0);
  problem.duration = 0.8;
  problem.inputs.grid = grid;
  problem.inputs.values.assign(grid.size(), Vector::Constant(1, u));
  problem.effort = Vector::Constant(1, 0.1);
  problem.weight = problem.target = Vector::Zero(2);
  return problem;
}

TEST(NamedCosts, OfABallInClosedForm) {
  const auto ball = MakeModel("driven_ball", {{"mass", 2}});
  constexpr double kForce = 3, kMass = 2;
  TrajectoryProblem problem = ProblemOfBall({0, 0.3}, kForce);
  problem.effort.setZero();
  problem.power = {{0, 0, 0.25}};
  const double a = kForce / kMass - kBallGravity, hit = std::sqrt(-2 / a), rest = 0.8 - hit;
  const double v = -kBallRestitution * a * hit;
  const double squares = a * a * hit * hit * hit / 3 + v * v * rest + a * v * rest * rest +
                         a * a * rest * rest * rest / 3;
  {
    const Unknowns unknowns(*ball, problem);
    EXPECT_NEAR(0.25 * kForce * kForce * squares, CostAt(unknowns, unknowns.Start()), 1e-9);
  }
  problem.power.clear();
  problem.impulse_weight = Vector::Constant(1, 0.5);
  const Unknowns unknowns(*ball, problem);
  const double impulse = kMass * (1 + kBallRestitution) * std::abs(a) * hit;
  EXPECT_NEAR(0.5 * impulse * impulse, CostAt(unknowns, unknowns.Start()), 1e-9);
}

/// Slopes in random directions against the piece that holds them.
void CheckSlopes(const Unknowns& unknowns, unsigned seed, std::size_t pieces) {
  const Vector y = unknowns.Start();
  const PieceModels models = MakePieceModels(unknowns, y);
  ASSERT_TRUE(models.status.ok()) << models.status.message;
  ASSERT_EQ(pieces, models.pieces.size());
  EXPECT_NEAR(CostAt(unknowns, y), models.cost, 1e-8 * (1 + std::abs(models.cost)));
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<int> met(pieces, 0);
  for (int trial = 0; trial < 20; ++trial) {
    const Vector d = Vector::NullaryExpr(y.size(), [&] { return normal(random); }).normalized();
    for (std::size_t i = 0; i < pieces; ++i) {
      const PieceModel& piece = models.pieces[i];
      bool holds = true;
      for (const OrderRow& order : piece.orders) {
        holds = holds && (std::abs(order.slack) > 1e-5 || order.row.dot(d) > 0);
      }
      if (!holds) continue;
      ++met[i];
      const double slope = piece.gradient.dot(d);
      double errors[2];
      constexpr double kSteps[] = {2e-4, 1e-4};
      for (int j = 0; j < 2; ++j) {
        errors[j] = (CostAt(unknowns, y + kSteps[j] * d) - models.cost) / kSteps[j] - slope;
      }
      // Of first order: the error halves with the step, down to that of the kink's place.
      EXPECT_NEAR(errors[1], errors[0] / 2,
                  0.02 * std::abs(errors[0]) + 2e-5 * (1 + std::abs(slope)))
          << "piece " << i << " (" << piece.label << "), slope " << slope;
      EXPECT_LT(std::abs(errors[1]), 0.02 * (1 + std::abs(slope))) << slope;
    }
  }
  for (std::size_t i = 0; i < pieces; ++i) EXPECT_GT(met[i], 0) << i;
}

TEST(NamedCosts, HaveTheSlopesOfPlainRuns) {
  const auto ball = MakeModel("driven_ball");
  for (const bool at_the_change : {false, true}) {
    for (const bool power : {true, false}) {
      const double hit = std::sqrt(2 / (kBallGravity - 1));
      TrajectoryProblem problem = ProblemOfBall({0, 0.2, at_the_change ? hit : 0.4, 0.6}, 1);
      problem.inputs.values[2](0) = -2;
      problem.inputs.values[3](0) = 3;
      problem.choose_initial = {0, 1};
      if (power) {
        problem.power = {{0, 0, 0.2}};
      } else {
        problem.impulse_weight = Vector::Constant(1, 0.3);
      }
      const Unknowns unknowns(*ball, problem);
      if (power && at_the_change && !HaveLinearPrograms()) {
        const Status status = MakePieceModels(unknowns, unknowns.Start()).status;
        EXPECT_NE(std::string::npos, status.message.find("without Clp")) << status.message;
        continue;
      }
      CheckSlopes(unknowns, at_the_change ? 1 : 2, at_the_change ? 2 : 1);
    }
  }
}

/// Several coordinates, an inertia and surfaces that bend, parameters.
TEST(NamedCosts, HaveTheSlopesOfBodiesAndPendulums) {
  int checked = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    std::mt19937 random(seed);
    const auto uniform = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    TrajectoryProblem problem;
    std::unique_ptr<MechanicalSystem> system;
    if (seed % 2 == 0) {
      system = MakeModel("double_pendulum");
      problem.x = system->nominal().x;
      problem.x(0) += uniform(-0.03, 0.03);  // its stops are not met at once
      problem.x(2) += uniform(0.05, 0.1);
      problem.duration = 0.95;
    } else {
      test::PushedBodies::Parameters<double> p;
      p.first = 0.6;
      p.second = seed % 4 == 1 ? 0 : 0.5;
      p.bend = uniform(-0.3, 0.3);
      p.coupling = uniform(-1, 1);
      system = std::make_unique<test::Bodies>(test::Named(p));
      problem.x = Vector::Zero(6);
      problem.x.head(3) << uniform(0.4, 0.6), uniform(0.8, 1), 1.5;
      problem.duration = 0.7;
    }
    for (int k = 0; k < 4; ++k) {
      problem.inputs.grid.push_back(problem.duration * k / 4.3);
      problem.inputs.values.push_back(
          Vector::NullaryExpr(system->num_inputs(), [&] { return uniform(-0.2, 0.2); }));
    }
    problem.effort = Vector::Constant(system->num_inputs(), 0.02);
    problem.weight = problem.target = Vector::Zero(system->state_size());
    problem.power = {{0, 0, 0.7}, {1, 1, 0.3}};
    problem.impulse_weight = Vector::Constant(system->num_constraints(), 0.4);
    const Trajectory run = Simulate(*system, problem.x, problem.inputs, problem.duration);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    if (run.transitions.size() <= 3) continue;  // nothing but changes of the input
    ++checked;
    CheckSlopes(Unknowns(*system, problem), seed, 1);
  }
  EXPECT_GE(checked, 5);
}

/// Several contacts are hit at once, where M and Da depend on q: by differences of the impulses.
/// Systems without bilateral constraints, which random velocities would leave.
TEST(NamedCosts, ImpulsesHaveTheDerivativeOfTheirDifferences) {
  int checked = 0;
  for (const char* name : {"rigid_biped", "rigid_quadruped", "double_pendulum"}) {
    const auto system = MakeModel(name);
    const int d = system->dof(), nq = system->num_positions();
    ASSERT_EQ(nq, d) << name;
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    const ConstraintSet all = ConstraintSet::All(system->num_constraints()) - system->compliant();
    const auto solve = [&](const Vector& x) {
      return SolveImpact(*system, x.head(nq), x.tail(d), all);
    };
    for (int trial = 0; trial < 20; ++trial) {
      Vector x = system->nominal().x + Vector::NullaryExpr(2 * d, [&] { return normal(random); });
      const ImpactResult result = solve(x);
      if (result.hit.Empty()) continue;
      const InverseInertia inertia(*system, x.head(nq), x.tail(d));
      const Matrix exact =
          ImpulseJacobian(*system, inertia, x.head(nq), x.tail(d), result, result.hit, {});
      constexpr double kStep = 1e-6;
      for (int i = 0; i < 2 * d; ++i) {
        const Vector step = kStep * Vector::Unit(2 * d, i);
        const ImpactResult above = solve(x + step), below = solve(x - step);
        if (above.hit != result.hit || below.hit != result.hit) continue;
        const Vector quotient = (above.impulse - below.impulse).head(exact.rows()) / (2 * kStep);
        const double scale = 1 + exact.cwiseAbs().maxCoeff();
        EXPECT_LT((exact.col(i) - quotient).cwiseAbs().maxCoeff(), 1e-6 * scale) << name << i;
        checked += result.hit.Size() > 1;
      }
    }
  }
  EXPECT_GT(checked, 100);
}

TEST(NamedCosts, OptimaAreMinima) {
  const auto ball = MakeModel("driven_ball");
  TrajectoryProblem problem = ProblemOfBall({0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7}, 0);
  problem.weight = Eigen::Vector2d(100, 10);
  problem.target = Eigen::Vector2d(0.6, 0);
  const double without = OptimizeTrajectory(*ball, problem).cost;
  problem.power = {{0, 0, 0.05}};
  problem.impulse_weight = Vector::Constant(1, 0.2);
  const TrajectoryOptimum found = OptimizeTrajectory(*ball, problem);
  EXPECT_TRUE(found.verdict == TrajectoryVerdict::kSmoothMinimum ||
              found.verdict == TrajectoryVerdict::kValley)
      << found.message;
  EXPECT_GT(found.cost, without);
  const Unknowns unknowns(*ball, problem);
  EXPECT_NEAR(found.cost, CostAt(unknowns, found.y), 1e-10);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 40; ++trial) {
    const Vector d =
        Vector::NullaryExpr(found.y.size(), [&] { return normal(random); }).normalized();
    for (double step : {1e-3, 1e-1}) {
      EXPECT_GT(CostAt(unknowns, found.y + step * d), found.cost - 1e-9) << step;
    }
  }
}

TEST(NamedCosts, WhatHasNoDerivativeAndMisuseAreRefused) {
  const auto ball = MakeModel("driven_ball");
  TrajectoryProblem problem = ProblemOfBall({0}, 0);
  problem.power = {{1, 0, 1}};
  EXPECT_THROW(Unknowns(*ball, problem), std::invalid_argument);
  problem.power = {{0, 1, 1}};
  EXPECT_THROW(Unknowns(*ball, problem), std::invalid_argument);
  problem.power = {{0, 0, -1}};
  EXPECT_THROW(Unknowns(*ball, problem), std::invalid_argument);
  problem.power.clear();
  problem.impulse_weight = Vector::Ones(2);
  EXPECT_THROW(Unknowns(*ball, problem), std::invalid_argument);
  // Both feet at once: what the second impact costs is not differentiated.
  const auto pendulum = MakeModel("double_pendulum");
  TrajectoryProblem both;
  both.x = pendulum->nominal().x;
  both.duration = pendulum->nominal().duration;
  both.inputs = InputSchedule::Constant(pendulum->nominal().u);
  both.effort = Vector::Ones(2);
  both.weight = both.target = Vector::Zero(4);
  both.impulse_weight = Vector::Ones(pendulum->num_constraints());
  const Unknowns unknowns(*pendulum, both);
  const PieceModels models = MakePieceModels(unknowns, unknowns.Start());
  EXPECT_EQ(Outcome::kNotDifferentiable, models.status.outcome);
  EXPECT_NE(std::string::npos, models.status.message.find("impulses")) << models.status.message;
}

}  // namespace
}  // namespace contact_flow
