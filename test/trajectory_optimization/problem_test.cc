// SPDX-License-Identifier: BSD-3-Clause
// What may be chosen and what it costs: the models of L against quotients of plain runs.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "test/derivative/input_cases.h"

namespace contact_flow {
namespace {

using Kind = TrajectoryCondition::Kind;

/// Two of three bodies fall on floors, under two inputs; everything may be chosen.
class Everything {
 public:
  explicit Everything(int seed) : random_(static_cast<unsigned>(seed)) {
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
    problem.x = Vector::Zero(6);
    problem.x.head(3) << Uniform(0.4, 1), Uniform(0.4, 1), 1.5;
    problem.duration = 0.75;
    for (int k = 0; k < 6; ++k) {
      problem.inputs.grid.push_back(0.125 * k);
      problem.inputs.values.push_back(Eigen::Vector2d(Uniform(-2, 2), Uniform(-2, 2)));
    }
    problem.choose_initial = {0, 3, 4};
    problem.choose_parameters = {0, 2, 4};  // a restitution, a force, a floor
    problem.choose_durations = {1, 2, 4};
    problem.keep_horizon = seed % 2 == 0;
    if (!problem.keep_horizon) problem.choose_durations.push_back(5);
    problem.effort = Eigen::Vector2d(0.02, 0.03);
    problem.weight = Vector::NullaryExpr(6, [&] { return Uniform(0, 3); });
    problem.target = Vector::NullaryExpr(6, [&] { return Uniform(0, 1); });
    problem.path_weight = Vector::NullaryExpr(3, [&] { return Uniform(0, 3); });
    problem.path_reference = Matrix::NullaryExpr(3, 6, [&] { return Uniform(0, 1); });
    problem.duration_weight = 0.7;
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
    const Trajectory run = unknowns.Run(y, 1e-12, false);
    const Matrix states = unknowns.States(run);
    return unknowns.Cost(y, states) +
           multipliers.Penalty(problem.conditions, ConditionValues(unknowns, run, states));
  }

  std::unique_ptr<MechanicalSystem> system;
  TrajectoryProblem problem;
  Multipliers multipliers;

 private:
  std::mt19937 random_;
};

/// By inputs, initial state, parameters and durations, with costs and conditions of every kind.
TEST(TrajectoryProblems, GradientsByEverythingAreThoseOfRuns) {
  int compared = 0;
  for (int seed = 0; seed < 20; ++seed) {
    Everything random(seed);
    const Unknowns unknowns(*random.system, random.problem);
    ASSERT_EQ(12 + 3 + 3 + (seed % 2 == 0 ? 3 : 4), unknowns.size());
    const Vector y = unknowns.Start();
    const PieceModels models = MakePieceModels(unknowns, y, 720, random.multipliers);
    ASSERT_TRUE(models.status.ok()) << seed << ": " << models.status.message;
    ASSERT_EQ(1u, models.pieces.size());
    ASSERT_NEAR(models.cost, random.L(unknowns, y), 1e-9 * (1 + models.cost)) << seed;
    for (int i = 0; i < unknowns.size(); ++i) {
      // Central, extrapolated: an error of order a⁴ and of 1e-11/a by rounding.
      constexpr double a = 3e-4;
      const auto quotient = [&](double step) {
        return (random.L(unknowns, y + step * Vector::Unit(y.size(), i)) -
                random.L(unknowns, y - step * Vector::Unit(y.size(), i))) /
               (2 * step);
      };
      const double slope = (4 * quotient(a) - quotient(2 * a)) / 3;
      const double g = models.pieces.front().gradient(i);
      EXPECT_NEAR(slope, g, 1e-5 * (1 + std::abs(g))) << seed << ", unknown " << i;
      ++compared;
    }
  }
  EXPECT_GE(compared, 400);
}

/// Where a touchdown falls on an instant of the grid that may move: each piece against one-sided
/// quotients in directions that lead into it.
TEST(TrajectoryProblems, PiecesByMovingInstantsAreThoseOfRuns) {
  int pieces = 0;
  for (int seed = 0; seed < 12; ++seed) {
    Everything random(seed);
    random.problem.conditions = {{Kind::kTouchdown, 0, 0, 0.3, 0.3}};
    random.multipliers.lambda = Vector::Constant(1, 0.4);
    random.multipliers.rho = Vector::Constant(1, 5);
    random.problem.path_weight = Vector();
    random.problem.kink_interval = 1e-9;
    // The second interval ends with the first touchdown, under the input that leads to it.
    InputSchedule& inputs = random.problem.inputs;
    for (std::size_t k = 1; k < 6; ++k) inputs.values[k] = inputs.values[0];
    const Unknowns held(*random.system, random.problem);
    const double t = TimeOf(held.Run(held.Start(), 1e-12, false), {0, 0});
    ASSERT_TRUE(std::isfinite(t));
    for (std::size_t k = 1; k < 6; ++k) {
      const auto number = static_cast<double>(k);
      inputs.grid[k] = k < 3 ? t * number / 2 : t + 0.07 * (number - 2);
    }
    inputs.values[2] += Eigen::Vector2d(1.5, -1);
    random.problem.duration = t + 0.35;
    const Unknowns unknowns(*random.system, random.problem);
    const Vector y = unknowns.Start();
    const Trajectory moved = unknowns.Run(y, 1e-12, false);
    ASSERT_NEAR(unknowns.Inputs(y).grid[2], TimeOf(moved, {0, 0}), 1e-12) << seed;
    const PieceModels models = MakePieceModels(unknowns, y, 720, random.multipliers);
    ASSERT_TRUE(models.status.ok()) << seed << ": " << models.status.message;
    ASSERT_EQ(2u, models.pieces.size()) << seed;
    for (const PieceModel& piece : models.pieces) {
      const OrderRow* face = nullptr;
      for (const OrderRow& row : piece.orders) {
        if (std::abs(row.slack) < 1e-8) face = &row;
      }
      ASSERT_NE(nullptr, face) << seed;
      for (int j = 0; j < 6; ++j) {
        Vector d = Vector::NullaryExpr(y.size(), [&] { return random.Uniform(-1, 1); });
        if (face->row.dot(d) < 0) d = -d;
        constexpr double a = 1e-4;  // as above, one-sided: of order a², 1e-11/a by rounding
        const auto cost = [&](double step) { return random.L(unknowns, y + step * d); };
        const double slope = (4 * cost(a) - cost(2 * a) - 3 * cost(0)) / (2 * a);
        const double g = piece.gradient.dot(d);
        EXPECT_NEAR(slope, g, 2e-5 * (1 + std::abs(g)) + 30 * a * a) << seed << piece.label;
        ++pieces;
      }
    }
  }
  EXPECT_EQ(144, pieces);
}

TEST(TrajectoryProblems, MisuseIsRefused) {
  const auto refused = [](const char* part, const std::function<void(TrajectoryProblem*)>& spoil) {
    Everything random(1);
    spoil(&random.problem);
    try {
      Unknowns(*random.system, random.problem);
      ADD_FAILURE() << part;
    } catch (const std::invalid_argument& refusal) {
      EXPECT_NE(std::string::npos, std::string(refusal.what()).find(part)) << refusal.what();
    }
  };
  refused("choose_parameters has no such index", [](auto* p) { p->choose_parameters = {5}; });
  refused("choose_parameters has an index twice", [](auto* p) { p->choose_parameters = {1, 1}; });
  refused("needs a factory", [](auto* p) { p->factory = nullptr; });
  refused("choose_durations has no such index", [](auto* p) { p->choose_durations = {6}; });
  refused("the last interval cannot be chosen", [](auto* p) { p->keep_horizon = true; });
  refused("duration_lower", [](auto* p) { p->duration_lower = Vector::Zero(4); });
  refused("duration_weight", [](auto* p) { p->duration_weight = -1; });
  refused("path_reference", [](auto* p) { p->path_reference = Matrix::Zero(3, 5); });
  refused("conditions[0] has no such number", [](auto* p) { p->conditions[0].number = 7; });
  refused("conditions[0] has no such index", [](auto* p) { p->conditions[0].index = 6; });
  refused("conditions[1]: the lower", [](auto* p) { p->conditions[1].lower = 1; });
  refused("conditions[1]: the lower", [](auto* p) { p->conditions[1].lower = std::nan(""); });
  refused("condition_tolerance", [](auto* p) { p->condition_tolerance = 0; });
}

}  // namespace
}  // namespace contact_flow
