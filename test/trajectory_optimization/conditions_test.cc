// SPDX-License-Identifier: BSD-3-Clause
// Conditions of trajectories, durations and parameters as unknowns: the driven ball against
// closed forms.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "contact_flow/model/model_library.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "test/trajectory_optimization/driven_ball.h"

namespace contact_flow {
namespace {

using test::kBallGravity;

using Kind = TrajectoryCondition::Kind;

constexpr int kInputs = 50;
constexpr double kInterval = 0.02, kWeight = 1e-3;

/// How position and velocity at t depend on inputs without contact.
struct Free {
  Vector position, velocity;
  explicit Free(double t) : position(kInputs), velocity(kInputs) {
    for (int i = 0; i < kInputs; ++i) {
      const double a = std::min(t, i * kInterval), b = std::min(t, (i + 1) * kInterval);
      velocity(i) = b - a;
      position(i) = ((t - a) * (t - a) - (t - b) * (t - b)) / 2;
    }
  }
};

/// min Σ kWeight u² with rows u = values: u = rowsᵀ (rows rowsᵀ)⁻¹ values.
Vector LeastEffort(const Matrix& rows, const Vector& values) {
  return rows.transpose() * (rows * rows.transpose()).partialPivLu().solve(values);
}

class BallConditions : public testing::Test {
 protected:
  BallConditions() : system(MakeModel("driven_ball")) {
    problem.x = Eigen::Vector2d(4, 0);
    for (int k = 0; k < kInputs; ++k) {
      problem.inputs.grid.push_back(k * kInterval);
      problem.inputs.values.push_back(Vector::Zero(1));
    }
    problem.duration = kInputs * kInterval;
    problem.effort = Vector::Constant(1, kWeight / kInterval);
    problem.weight = problem.target = Vector::Zero(2);
  }

  TrajectoryOptimum Solve(bool neighbours = false) const {
    TrajectoryOptions options;
    options.neighbours = neighbours;
    return OptimizeTrajectory(*system, problem, options);
  }
  void ExpectMet(const TrajectoryOptimum& found, double tolerance = 1e-8) const {
    ASSERT_EQ(static_cast<Eigen::Index>(problem.conditions.size()), found.condition_values.size())
        << found.message;
    EXPECT_LE(Violations(problem.conditions, found.condition_values).maxCoeff(), tolerance);
    EXPECT_LE(found.iterations.back().violation, tolerance);
  }

  /// min Σ kWeight u² with one impact at τ, from where the ball is at (1, 0) at the end.
  double BestWithImpactAt(double tau) const {
    const double end = kInputs * kInterval, rest = end - tau, gamma = 0.7;
    const Free fall(tau), whole(end);
    Matrix rows(3, kInputs);
    rows.row(0) = fall.position;
    // ẏ⁺ = γ (g τ − fall.velocity·u); behind it forces act as they do without a floor.
    const Vector later_velocity = whole.velocity - fall.velocity;
    const Vector later_position = whole.position - fall.position - rest * fall.velocity;
    rows.row(1) = -gamma * rest * fall.velocity + later_position;
    rows.row(2) = -gamma * fall.velocity + later_velocity;
    const Eigen::Vector3d values(
        kBallGravity * tau * tau / 2 - 4,
        1 - gamma * kBallGravity * tau * rest + kBallGravity * rest * rest / 2,
        -gamma * kBallGravity * tau + kBallGravity * rest);
    return kWeight * LeastEffort(rows, values).squaredNorm();
  }

  const std::unique_ptr<MechanicalSystem> system;
  TrajectoryProblem problem;
};

/// Far from the floor: a linear system, whose least effort and multipliers are known.
TEST_F(BallConditions, EqualitiesAtTheEndOfALinearSystem) {
  problem.x(0) = 40;
  problem.conditions = {{Kind::kState, 0, kInputs, 38, 38}, {Kind::kState, 1, kInputs, 0.5, 0.5}};
  const TrajectoryOptimum found = Solve();
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
  ExpectMet(found);
  const Free free(1);
  Matrix rows(2, kInputs);
  rows << free.position.transpose(), free.velocity.transpose();
  const Eigen::Vector2d values(38 - 40 + kBallGravity / 2, 0.5 + kBallGravity);
  const Vector u = LeastEffort(rows, values);
  EXPECT_NEAR(kWeight * u.squaredNorm(), found.cost, 1e-7);  // λ ~ 4 per unit that misses 1e-8
  // ∇J + λᵀ rows = 0. Errors: those of the conditions, 1e-8, times dλ/dc ~ 1e-2 … 1.
  const Vector lambda = -(rows * rows.transpose()).partialPivLu().solve(rows * u) * 2 * kWeight;
  EXPECT_LT((lambda - found.multipliers).cwiseAbs().maxCoeff(), 1e-6);
}

/// Through an impact: valleys at instants of the grid, the lowest of them by neighbours.
TEST_F(BallConditions, EqualitiesAtTheEndThroughAnImpact) {
  problem.conditions = {{Kind::kState, 0, kInputs, 1, 1}, {Kind::kState, 1, kInputs, 0, 0}};
  for (Vector& value : problem.inputs.values) value(0) = -20;
  const TrajectoryOptimum plain = Solve();
  ASSERT_EQ(TrajectoryVerdict::kValley, plain.verdict) << plain.message;
  ExpectMet(plain);
  double nearest = 1, lowest = 1e300;
  for (int k = 20; k < 45; ++k) {
    nearest = std::min(nearest, std::abs(BestWithImpactAt(k * kInterval) - plain.cost));
    lowest = std::min(lowest, BestWithImpactAt(k * kInterval));
  }
  EXPECT_LT(nearest, 1e-7);  // λ ~ 3 per unit of a condition that may miss 1e-8
  ASSERT_EQ(2u, plain.certificate.size());
  EXPECT_LT(plain.hull_distance, 1e-6);
  for (const PieceProof& piece : plain.certificate) {
    ASSERT_EQ(1u, piece.slopes.size());
    EXPECT_GT(piece.slopes.front().slope, 0);
    EXPECT_LT(piece.residual, 1e-6);
  }
  const TrajectoryOptimum best = Solve(true);
  EXPECT_EQ(TrajectoryVerdict::kValley, best.verdict) << best.message;
  ExpectMet(best);
  EXPECT_NEAR(lowest, best.cost, 1e-7);
}

/// Touch the floor at a time, inside an interval of the grid and at its end.
TEST_F(BallConditions, TouchdownAtATime) {
  for (double tau : {0.65, 0.64}) {
    problem.conditions = {{Kind::kState, 0, kInputs, 1, 1},
                          {Kind::kState, 1, kInputs, 0, 0},
                          {Kind::kTouchdown, 0, 0, tau, tau}};
    const TrajectoryOptimum found = Solve();
    EXPECT_LE(static_cast<int>(found.verdict), static_cast<int>(TrajectoryVerdict::kValley))
        << found.message;
    ExpectMet(found);
    EXPECT_NEAR(BestWithImpactAt(tau), found.cost, 1e-6) << tau;
  }
}

/// At an apex of a given height at an instant of the grid, then on to the end.
TEST_F(BallConditions, ApexAtAnInstant) {
  problem.x(0) = 40;
  problem.conditions = {{Kind::kState, 0, 20, 40.3, 40.3},
                        {Kind::kState, 1, 20, 0, 0},
                        {Kind::kState, 0, kInputs, 39, 39}};
  const TrajectoryOptimum found = Solve();
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
  ExpectMet(found);
  const Free apex(20 * kInterval), end(1);
  Matrix rows(3, kInputs);
  rows << apex.position.transpose(), apex.velocity.transpose(), end.position.transpose();
  const double t = 20 * kInterval;
  const Eigen::Vector3d values(0.3 + kBallGravity * t * t / 2, kBallGravity * t,
                               -1 + kBallGravity / 2);
  EXPECT_NEAR(kWeight * LeastEffort(rows, values).squaredNorm(), found.cost, 1e-7);
}

/// A ceiling at every instant: feasible, and KKT's conditions in the linear system's own matrices.
TEST_F(BallConditions, PathBounds) {
  problem.x = Eigen::Vector2d(40, 3);
  for (int k = 1; k < kInputs; ++k) problem.conditions.push_back({Kind::kState, 0, k, 39.5, 40.3});
  problem.conditions.push_back({Kind::kState, 0, kInputs, 40, 40});
  const TrajectoryOptimum found = Solve();
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
  ExpectMet(found);
  int active = 0;
  Vector force = Vector::Zero(kInputs);
  for (int k = 0; k < kInputs; ++k) {
    const double lambda = found.multipliers(k);
    force += lambda * Free((k + 1) * kInterval).position;
    if (k + 1 == kInputs) break;
    EXPECT_GE(lambda, found.condition_values(k) > 39.6 ? 0 : -1e300) << k;
    if (lambda != 0) {
      ++active;
      EXPECT_NEAR(lambda > 0 ? 40.3 : 39.5, found.condition_values(k), 1e-8) << k;
    }
  }
  EXPECT_GE(active, 1);
  for (int k = 0; k < kInputs; ++k) {
    const double own = 2 * kWeight * found.inputs.values[static_cast<std::size_t>(k)](0);
    // The promise that counts as none is 1e-10: √(2·1e-10·2e-3) = 6e-7.
    EXPECT_NEAR(0, own + force(k), 2e-6) << k;
  }
}

/// From rest to rest 1 m higher without gravity, in two pushes whose lengths are free: with
/// ∫ u² + w T the least is at h = (3/w)^(1/4) each, 2/h³ + 2 w h.
TEST_F(BallConditions, DurationsAndHorizonMayBeChosen) {
  const auto floating = MakeModel("driven_ball", {{"gravity", 0.0}});
  TrajectoryProblem free;
  free.x = Eigen::Vector2d(1, 0);
  free.inputs.grid = {0, 0.7};
  free.inputs.values = {Vector::Constant(1, 1), Vector::Constant(1, -1)};
  free.duration = 2;
  free.effort = Vector::Ones(1);
  free.weight = free.target = Vector::Zero(2);
  free.duration_weight = 5;
  free.choose_durations = {0, 1};
  free.conditions = {{Kind::kState, 0, 2, 2, 2}, {Kind::kState, 1, 2, 0, 0}};
  const TrajectoryOptimum found = OptimizeTrajectory(*floating, free);
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
  const double h = std::pow(3.0 / 5, 0.25);
  EXPECT_NEAR(2 / (h * h * h) + 10 * h, found.cost, 1e-6);
  EXPECT_NEAR(2 * h, found.duration, 1e-4);
  EXPECT_NEAR(h, found.inputs.grid[1], 1e-4);
  // The horizon kept: the effort is least in two halves, 4/(T h₁ h₂).
  free.choose_durations = {0};
  free.keep_horizon = true;
  const TrajectoryOptimum kept = OptimizeTrajectory(*floating, free);
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, kept.verdict) << kept.message;
  EXPECT_EQ(2, kept.duration);
  EXPECT_NEAR(1, kept.inputs.grid[1], 1e-4);
  EXPECT_NEAR(2 + 5 * 2, kept.cost, 1e-6);
}

/// Where lengths cost little beside what Gauss and Newton count, ∇²J is learnt: the least is that
/// of L-BFGS with a closed form of J.
TEST_F(BallConditions, ShallowDurationsAreFound) {
  const auto heavy =
      MakeModel("driven_ball", {{"mass", 2.0}, {"gravity", 4.0}, {"restitution", 1.0}});
  TrajectoryProblem shallow;
  shallow.x = Eigen::Vector2d(3.1, 0);
  shallow.inputs.grid = {0, 0.39, 0.55};
  for (double u : {4.8, -3.2, -5.8}) shallow.inputs.values.push_back(Vector::Constant(1, u));
  shallow.duration = 0.85;
  shallow.effort = Vector::Constant(1, 0.0753);
  shallow.input_reference = Vector::Constant(1, 3);
  shallow.weight = Eigen::Vector2d(4.45, 19.93);
  shallow.target = Eigen::Vector2d(2.39, -2.14);
  shallow.duration_weight = 2.54;
  shallow.lower = Vector::Constant(1, -6.6);
  shallow.upper = Vector::Constant(1, 4.8);
  shallow.choose_durations = {0, 2};
  const TrajectoryOptimum found = OptimizeTrajectory(*heavy, shallow);
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
  EXPECT_NEAR(1.7432240033507, found.cost, 1e-9);
  EXPECT_LT(found.iterations.size(), 100u);
}

/// The restitution by which a ball that falls is at 0.5 m at the end: γ g τ (T − τ) − g (T − τ)²/2.
TEST_F(BallConditions, ParametersMayBeChosen) {
  problem.choose_inputs = false;
  problem.choose_parameters = {2};
  ASSERT_EQ("restitution", system->description().parameters[2].name);
  problem.parameter_lower = Vector::Zero(1);
  problem.parameter_upper = Vector::Ones(1);
  problem.factory = [](const ParameterValues& values) { return MakeModel("driven_ball", values); };
  problem.conditions = {{Kind::kState, 0, kInputs, 0.5, 0.5}};
  const TrajectoryOptimum found = Solve();
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
  ExpectMet(found);
  const double tau = std::sqrt(8 / kBallGravity), rest = 1 - tau;
  ASSERT_EQ(1, found.parameters.size());
  EXPECT_NEAR((0.5 + kBallGravity * rest * rest / 2) / (kBallGravity * tau * rest),
              found.parameters(0), 1e-7);
}

TEST_F(BallConditions, WhatCannotBeMetIsNamed) {
  problem.x(0) = 40;
  problem.lower = Vector::Constant(1, -1);
  problem.upper = Vector::Constant(1, 1);
  problem.conditions = {{Kind::kState, 0, kInputs, 39, 39}};
  const TrajectoryOptimum found = Solve();
  EXPECT_EQ(TrajectoryVerdict::kInfeasible, found.verdict) << found.message;
  EXPECT_NE(std::string::npos, found.message.find("z at the end is 35.6")) << found.message;
  // A touchdown that does not happen has no time.
  problem.conditions = {{Kind::kTouchdown, 0, 0, 0.5, 0.5}};
  const TrajectoryOptimum never = Solve();
  EXPECT_EQ(TrajectoryVerdict::kUndefined, never.verdict);
  EXPECT_NE(std::string::npos, never.message.find("touchdown")) << never.message;
  problem.conditions.clear();
  problem.x(0) = -0.1;
  const TrajectoryOptimum below = Solve();
  EXPECT_EQ(TrajectoryVerdict::kUndefined, below.verdict);
  EXPECT_NE(std::string::npos, below.message.find("penetrates")) << below.message;
}

}  // namespace
}  // namespace contact_flow
