// SPDX-License-Identifier: BSD-3-Clause
// Inputs that are led linearly: models of L against quotients of plain runs, through touchdowns and
// with instants that coincide with them, and optima in closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "test/derivative/input_cases.h"
#include "test/trajectory_optimization/line_problem_runs.h"

namespace contact_flow {
namespace {

using Kind = TrajectoryCondition::Kind;

/// Two of three bodies fall on floors, under two inputs; everything may be chosen.
class WithLinearInputs {
 public:
  explicit WithLinearInputs(int seed) : random_(static_cast<unsigned>(seed)) {
    test::PushedBodies::Parameters<double> p;
    p.first = Uniform(0.6, 0.8);  // not so low that bounces accumulate
    p.second = Uniform(0.6, 0.8);
    p.bend = Uniform(-0.3, 0.3);
    p.coupling = Uniform(-1, 1);
    p.sink = 0.1;
    system = std::make_unique<test::Bodies>(test::Named(p));
    problem.factory = [](const ParameterValues& values) {
      return std::make_unique<test::Bodies>(values);
    };
    problem.linear_inputs = true;
    problem.x = Vector::Zero(6);
    problem.x.head(3) << Uniform(0.4, 1), Uniform(0.4, 1), 1.5;
    problem.duration = 0.75;
    for (int k = 0; k < 6; ++k) {
      problem.inputs.grid.push_back(0.125 * k);
      problem.inputs.values.push_back(Eigen::Vector2d(Uniform(-2, 2), Uniform(-2, 2)));
    }
    problem.input_end = Eigen::Vector2d(Uniform(-2, 2), Uniform(-2, 2));
    problem.choose_initial = {0, 3, 4};
    problem.choose_parameters = {0, 2, 4};  // a restitution, a force, a floor
    problem.choose_durations = {1, 2, 4};
    problem.keep_horizon = seed % 2 == 0;
    if (!problem.keep_horizon) problem.choose_durations.push_back(5);
    problem.effort = Eigen::Vector2d(0.02, 0.03);
    problem.input_reference = Eigen::Vector2d(0.3, -0.2);
    problem.weight = Vector::NullaryExpr(6, [&] { return Uniform(0, 3); });
    problem.target = Vector::NullaryExpr(6, [&] { return Uniform(0, 1); });
    problem.path_weight = Vector::NullaryExpr(3, [&] { return Uniform(0, 3); });
    problem.path_reference = Matrix::NullaryExpr(3, 6, [&] { return Uniform(0, 1); });
    problem.duration_weight = 0.7;
    problem.power = {{0, 0, 0.7}, {1, 1, 0.3}};
    problem.conditions = {{Kind::kState, 1, 3, 0.2, 0.2},
                          {Kind::kState, 5, 6, 0.1, 0.1},
                          {Kind::kState, 4, 2, -1, -0.5},
                          {Kind::kTouchdown, 0, 0, 0.3, 0.3}};
    multipliers.lambda = Vector::NullaryExpr(4, [&] { return Uniform(-2, 2); });
    multipliers.rho = Vector::NullaryExpr(4, [&] { return Uniform(1, 10); });
  }

  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  /// L of a plain run.
  double L(const Unknowns& unknowns, const Vector& y) const {
    const Trajectory run = unknowns.Run(y, 1e-12, true);
    EXPECT_TRUE(run.status.ok()) << run.status.message;
    return unknowns.Cost(y, run) +
           multipliers.Penalty(unknowns.problem().conditions,
                               ConditionValues(unknowns, run, unknowns.States(run)));
  }

  /// All entries of the gradient against central quotients, extrapolated: an error of order a⁴ and
  /// of 1e-11/a by rounding.
  int Compare(const Unknowns& unknowns, const PieceModel& piece, double a, double tolerance) {
    const Vector y = unknowns.Start();
    for (int i = 0; i < unknowns.size(); ++i) {
      const auto quotient = [&](double step) {
        return (L(unknowns, y + step * Vector::Unit(y.size(), i)) -
                L(unknowns, y - step * Vector::Unit(y.size(), i))) /
               (2 * step);
      };
      const double slope = (4 * quotient(a) - quotient(2 * a)) / 3;
      EXPECT_NEAR(slope, piece.gradient(i), tolerance * (1 + std::abs(slope))) << "unknown " << i;
    }
    return unknowns.size();
  }

  std::unique_ptr<MechanicalSystem> system;
  TrajectoryProblem problem;
  Multipliers multipliers;

 private:
  std::mt19937 random_;
};

TEST(LinearInputs, GradientsByEverythingAreThoseOfRuns) {
  int compared = 0;
  for (int seed = 0; seed < 12; ++seed) {
    WithLinearInputs random(seed);
    const Unknowns unknowns(*random.system, random.problem);
    ASSERT_EQ(14 + 3 + 3 + (seed % 2 == 0 ? 3 : 4), unknowns.size());
    const Vector y = unknowns.Start();
    const PieceModels models = MakePieceModels(unknowns, y, 720, random.multipliers);
    ASSERT_TRUE(models.status.ok()) << seed << ": " << models.status.message;
    ASSERT_EQ(1u, models.pieces.size());
    ASSERT_NEAR(models.cost, random.L(unknowns, y), 1e-9 * (1 + models.cost)) << seed;
    // Quotients must not reach across another order of events.
    const std::vector<EventTime>& times = models.pieces.front().times;
    double apart = 1;
    for (std::size_t i = 1; i < times.size(); ++i) {
      apart = std::min(apart, times[i].t - times[i - 1].t);
    }
    if (apart > 3e-3) compared += random.Compare(unknowns, models.pieces.front(), 3e-4, 1e-8);
  }
  EXPECT_GE(compared, 220);
}

/// An instant of the grid at a touchdown is no kink of the outcome: one piece, whose slopes are
/// those of both sides. Where positions at the instants cost, that instant's is one: it is met
/// before or behind the impact.
TEST(LinearInputs, AnInstantAtATouchdownIsNoKink) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  int coincidences = 0, slopes = 0;
  for (int seed = 0; seed < 12; ++seed) {
    WithLinearInputs random(seed);
    const bool path = seed % 2 == 1;
    TrajectoryProblem& problem = random.problem;
    problem.choose_durations.clear();
    problem.choose_parameters = {2};
    problem.conditions.clear();
    problem.input_reference = Vector();
    if (!path) problem.path_weight = Vector();
    problem.path_reference = Matrix();
    random.multipliers = {};
    const Unknowns before(*random.system, problem);
    const Trajectory run = before.Run(before.Start(), 1e-12, false);
    const Transition* touchdown = test::Touchdown(run, 0);
    if (touchdown == nullptr) continue;
    // On the same line of the input there is one instant more.
    std::vector<double>& grid = problem.inputs.grid;
    std::vector<Vector>& u = problem.inputs.values;
    std::size_t k = 0;
    while (k + 1 < grid.size() && grid[k + 1] < touchdown->t) ++k;
    const bool last = k + 1 == grid.size();
    const double end = last ? problem.duration : grid[k + 1];
    const Vector next = last ? problem.input_end : u[k + 1];
    const Vector between = u[k] + (touchdown->t - grid[k]) / (end - grid[k]) * (next - u[k]);
    u.insert(u.begin() + static_cast<long>(k) + 1, between);
    grid.insert(grid.begin() + static_cast<long>(k) + 1, touchdown->t);
    const Unknowns unknowns(*random.system, problem);
    const Vector y = unknowns.Start();
    const PieceModels models = MakePieceModels(unknowns, y);
    ASSERT_TRUE(models.status.ok()) << seed << ": " << models.status.message;
    ASSERT_EQ(path ? 2u : 1u, models.pieces.size()) << seed;
    for (int i = 0; i < 2 * unknowns.size(); ++i) {
      const Vector d = (i % 2 == 0 ? 1 : -1) * Vector::Unit(y.size(), i / 2);
      for (const PieceModel& piece : models.pieces) {
        bool holds = true;
        for (const OrderRow& order : piece.orders) {
          holds = holds && (std::abs(order.slack) > 1e-5 || order.row.dot(d) > 0);
        }
        if (!holds) continue;
        // Of first order: the error halves with the step.
        const double slope = piece.gradient.dot(d);
        double errors[2];
        constexpr double kSteps[] = {2e-4, 1e-4};
        for (int j = 0; j < 2; ++j) {
          errors[j] = (random.L(unknowns, y + kSteps[j] * d) - models.cost) / kSteps[j] - slope;
        }
        EXPECT_NEAR(errors[1], errors[0] / 2,
                    0.02 * std::abs(errors[0]) + 2e-5 * (1 + std::abs(slope)))
            << seed << ", direction " << i << " (" << piece.label << "), slope " << slope;
        EXPECT_LT(std::abs(errors[1]), 0.02 * (1 + std::abs(slope))) << seed << ", " << i;
        ++slopes;
      }
    }
    ++coincidences;
  }
  EXPECT_GE(coincidences, 8);
  EXPECT_GE(slopes, 250);
}

/// Of all inputs that lead a mass from rest at 0 to rest at 1 the one with the least ∫ u² is linear
/// in time, u = 6 − 12 t, at a cost of 12: a linear hold has it on any grid.
TEST(LinearInputs, LeadAMassInClosedForm) {
  const auto ball = MakeModel("driven_ball", {{"gravity", 0}, {"mass", 1}});
  TrajectoryProblem problem;
  problem.x = Eigen::Vector2d(5, 0);
  problem.duration = 1;
  problem.inputs.grid = {0, 0.3, 0.45};
  problem.inputs.values.assign(3, Vector::Zero(1));
  problem.linear_inputs = true;
  problem.effort = Vector::Ones(1);
  problem.weight = problem.target = Vector::Zero(2);
  problem.conditions = {{Kind::kState, 0, 3, 6, 6}, {Kind::kState, 1, 3, 0, 0}};
  const TrajectoryOptimum found = OptimizeTrajectory(*ball, problem);
  ASSERT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
  EXPECT_NEAR(12, found.cost, 1e-7);
  ASSERT_EQ(3u, found.inputs.values.size());
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(6 - 12 * problem.inputs.grid[k], found.inputs.values[k](0), 1e-6);
  }
  ASSERT_EQ(1, found.input_end.size());
  EXPECT_NEAR(-6, found.input_end(0), 1e-6);
  EXPECT_EQ(2, found.x.size());
  // Held inputs cost more on the same grid.
  problem.linear_inputs = false;
  EXPECT_GT(OptimizeTrajectory(*ball, problem).cost, 12.5);
}

/// A ball is thrown against the floor to be at rest at 1 m: by the least over all instants of the
/// bounce of what a linear system of equations says.
TEST(LinearInputs, ThrowABallAtTheFloorInClosedForm) {
  for (const double restitution : {1.0, 0.7}) {
    for (const int count : {3, 8}) {
      test::LineProblem line;
      line.mass = Vector::Constant(1, 2);
      line.gravity = -9.8;
      line.x = Eigen::Vector2d(1.5, 0);
      line.count = count;
      line.linear = true;
      line.effort = 0.01;
      line.weight = Eigen::Vector2d(100, 10);
      line.target = Eigen::Vector2d(1, 0);
      const auto ball = MakeModel("driven_ball", {{"mass", 2}, {"restitution", restitution}});
      const TrajectoryOptimum found = OptimizeTrajectory(*ball, test::BallOf(line, 0));
      EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
      const double best = line.Best({Vector::Ones(1), 0, restitution}, 0.05, 0.95);
      EXPECT_NEAR(best, found.cost, 1e-9 * (1 + best))
          << count << " intervals, restitution " << restitution;
    }
  }
}

TEST(LinearInputs, MisuseIsRefused) {
  const auto refusal = [](const MechanicalSystem& system, const TrajectoryProblem& problem) {
    try {
      const Unknowns unknowns(system, problem);
    } catch (const std::invalid_argument& reason) {
      return std::string(reason.what());
    }
    return std::string();
  };
  WithLinearInputs random(1);
  TrajectoryProblem problem = random.problem;
  EXPECT_EQ("", refusal(*random.system, problem));
  problem.input_end = Vector::Ones(3);
  EXPECT_NE(std::string::npos, refusal(*random.system, problem).find("input_end has 3 entries"));
  problem = random.problem;
  problem.linear_inputs = false;
  EXPECT_NE(std::string::npos, refusal(*random.system, problem).find("linear_inputs"));
  problem = random.problem;
  problem.x = Vector::Zero(5);
  EXPECT_NE(std::string::npos, refusal(*random.system, problem).find("x has 5 entries: 6"));
  // What is an index of the clock alone is none of the system.
  problem = random.problem;
  problem.conditions = {{Kind::kState, 6, 1, 0, 0}};
  EXPECT_NE(std::string::npos, refusal(*random.system, problem).find("conditions[0]"));
  problem = random.problem;
  problem.choose_initial = {6};
  EXPECT_NE(std::string::npos, refusal(*random.system, problem).find("choose_initial"));
  problem = random.problem;
  problem.power = {{0, 3, 1}};
  EXPECT_NE(std::string::npos, refusal(*random.system, problem).find("power"));
  problem.power = {{2, 0, 1}};
  EXPECT_NE(std::string::npos, refusal(*random.system, problem).find("power"));
  const auto biped = MakeModel("rigid_biped");
  TrajectoryProblem none;
  none.linear_inputs = true;
  EXPECT_NE(std::string::npos, refusal(*biped, none).find("without inputs"));
}

}  // namespace
}  // namespace contact_flow
