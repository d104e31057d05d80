// SPDX-License-Identifier: BSD-3-Clause
// Unknowns of unlike units, in several systems of units: one problem has one least cost.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "contact_flow/model/model_library.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

/// What a kilogram, a metre and a second are.
struct Units {
  double mass, length, time;
};

/// From 4 m at rest to rest in 1 m with a bounce of 0.7, by four forces: ∫ 0.01 u² dt, u in N, and
/// 100 |error|², in m and m/s.
TrajectoryProblem BallIn(const Units& unit) {
  const double l = unit.length, t = unit.time, force = unit.mass * l / (t * t);
  TrajectoryProblem problem;
  problem.x = test::Entries({4 * l, 0});
  problem.duration = 1.004 * t;
  for (int k = 0; k < 4; ++k) {
    problem.inputs.grid.push_back(0.25 * k * t);
    problem.inputs.values.push_back(Vector::Zero(1));
  }
  problem.effort = test::Entries({0.01 / (force * force * t)});
  problem.weight = test::Entries({100 / (l * l), 100 * t * t / (l * l)});
  problem.target = test::Entries({l, 0});
  return problem;
}

ParameterValues ParametersIn(const Units& unit) {
  return {{"mass", unit.mass},
          {"gravity", 9.8 * unit.length / (unit.time * unit.time)},
          {"restitution", 0.7}};
}

constexpr Units kUnits[] = {{1, 1, 1},     {1e3, 1, 1},   {1e3, 1e3, 1},
                            {1e6, 1e3, 1}, {1e9, 1e6, 1}, {1, 1e-3, 1},
                            {1, 1, 1e3},   {1, 1, 1e-3},  {1e-6, 1e-3, 1e2}};

TEST(UnitsOfUnknowns, RestitutionBesideForces) {
  for (const Units& unit : kUnits) {
    const auto ball = MakeModel("driven_ball", ParametersIn(unit));
    TrajectoryProblem problem = BallIn(unit);
    const auto& parameters = ball->description().parameters;
    int restitution = 0;
    while (parameters[static_cast<std::size_t>(restitution)].name != "restitution") ++restitution;
    problem.choose_parameters = {restitution};
    problem.factory = [](const ParameterValues& values) {
      return MakeModel("driven_ball", values);
    };
    problem.parameter_lower = test::Entries({0.1});
    problem.parameter_upper = test::Entries({0.9});
    const TrajectoryOptimum found = OptimizeTrajectory(*ball, problem);
    EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
    EXPECT_NEAR(0.5169191502, found.cost, 1e-8) << unit.mass << ", " << unit.length;
  }
}

TEST(UnitsOfUnknowns, InitialStateBesideForces) {
  for (const Units& unit : kUnits) {
    const double l = unit.length, t = unit.time;
    const auto ball = MakeModel("driven_ball", ParametersIn(unit));
    TrajectoryProblem problem = BallIn(unit);
    problem.choose_initial = {0, 1};
    problem.initial_upper = test::Entries({l, l / t});
    problem.initial_lower = -problem.initial_upper;
    const TrajectoryOptimum found = OptimizeTrajectory(*ball, problem);
    EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
    EXPECT_NEAR(0.1783603814, found.cost, 1e-8) << unit.mass << ", " << unit.length;
  }
}

/// Steps are damped beside the curvature of each unknown: the costs of all iterates are the same.
TEST(UnitsOfUnknowns, OnePathOfCosts) {
  std::vector<double> natural;
  for (const Units& unit : kUnits) {
    SCOPED_TRACE(testing::Message() << unit.mass << ", " << unit.length << ", " << unit.time);
    const double force = unit.mass * unit.length / (unit.time * unit.time);
    const auto ball = MakeModel("driven_ball", ParametersIn(unit));
    TrajectoryProblem problem = BallIn(unit);
    problem.choose_durations = {3};
    problem.duration_lower = Vector::Constant(1, 0.2 * unit.time);
    problem.duration_upper = 2 * problem.duration_lower;
    problem.inputs.values[1](0) = 30 * force;
    problem.inputs.values[2](0) = -20 * force;
    const TrajectoryOptimum found = OptimizeTrajectory(*ball, problem);
    EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
    std::vector<double> costs;
    for (const TrajectoryIteration& iteration : found.iterations) costs.push_back(iteration.cost);
    if (natural.empty()) natural = costs;
    ASSERT_EQ(natural.size(), costs.size());
    for (std::size_t k = 0; k < costs.size(); ++k) EXPECT_NEAR(1, costs[k] / natural[k], 1e-6) << k;
  }
}

/// Conditions beside an unknown that costs nothing of its own: of a heavier ball forces cost as
/// much less as they are larger, and nothing else changes.
class HeavyBalls : public testing::TestWithParam<double> {
 protected:
  HeavyBalls()
      : ball(MakeModel("driven_ball", {{"mass", GetParam()}})),
        problem(BallIn({GetParam(), 1, 1})) {
    using Kind = TrajectoryCondition::Kind;
    problem.weight = problem.target = Vector::Zero(2);
    problem.conditions = {{Kind::kState, 0, 4, 1, 1}, {Kind::kState, 1, 4, 0, 0}};
  }

  void ExpectCost(double cost) {
    const TrajectoryOptimum found = OptimizeTrajectory(*ball, problem);
    EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
    EXPECT_NEAR(cost, found.cost, 1e-7);
  }

  std::unique_ptr<MechanicalSystem> ball;
  TrajectoryProblem problem;
};

TEST_P(HeavyBalls, MeetConditionsByTheirStart) {
  problem.choose_initial = {1};
  problem.initial_upper = Vector::Ones(1);
  problem.initial_lower = -problem.initial_upper;
  ExpectCost(0.5784722978);
}

TEST_P(HeavyBalls, MeetConditionsByTheirDuration) {
  problem.choose_durations = {3};
  problem.duration_lower = Vector::Constant(1, 0.2);
  problem.duration_upper = Vector::Constant(1, 0.4);
  ExpectCost(0.4053503531);
}

INSTANTIATE_TEST_SUITE_P(UnitsOfUnknowns, HeavyBalls, testing::Values(1.0, 10.0, 100.0, 1e3, 1e4));

}  // namespace
}  // namespace contact_flow
