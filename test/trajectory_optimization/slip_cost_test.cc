// SPDX-License-Identifier: BSD-3-Clause
// Slip of contacts with friction as a cost: closed forms, and quotients of plain runs through
// touchdowns, releases and ends of slip.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "test/trajectory_optimization/cost_at.h"

namespace contact_flow {
namespace {

using test::CostAt;

TrajectoryProblem BlockProblem(const Vector& x, double duration, std::size_t count) {
  TrajectoryProblem problem;
  problem.x = x;
  problem.duration = duration;
  for (std::size_t k = 0; k < count; ++k) {
    problem.inputs.grid.push_back(duration * static_cast<double>(k) / static_cast<double>(count));
    problem.inputs.values.push_back(Vector::Zero(1));
  }
  problem.effort = Vector::Zero(1);
  problem.weight = problem.target = Vector::Zero(6);
  return problem;
}

/// A block that stops at a distance v²/(2b): ∫ v² dt = v³/(3b), b = g (μ cos φ − sin φ) − u/m.
TEST(SlipCost, OfABlockThatStopsInClosedForm) {
  const double mass = 2, incline = 0.2, friction = 0.6, gravity = 9.81, push = 0.7, speed = 1.3;
  const auto block = MakeModel(
      "block_on_incline",
      {{"mass", mass}, {"incline", incline}, {"friction", friction}, {"gravity", gravity}});
  Vector x = Vector::Zero(6);
  x(3) = speed;
  x(5) = 1;
  const double b = gravity * (friction * std::cos(incline) - std::sin(incline)) - push / mass;
  for (const bool linear : {false, true}) {
    TrajectoryProblem problem = BlockProblem(x, 1.5 * speed / b, 1);
    problem.inputs.values[0](0) = push;
    problem.linear_inputs = linear;
    problem.slip_weight = Vector::Constant(1, 0.5);
    const Unknowns unknowns(*block, problem);
    const PieceModels models = MakePieceModels(unknowns, unknowns.Start());
    ASSERT_TRUE(models.status.ok()) << models.status.message;
    ASSERT_EQ(1u, models.pieces.size());
    EXPECT_NEAR(0.5 * std::pow(speed, 3) / (3 * b), models.cost, 1e-10);
    // u at all times by as much: where inputs are led, at both ends.
    const double slope = models.pieces.front().gradient.sum();
    EXPECT_NEAR(0.5 * std::pow(speed, 3) / (3 * b * b) / mass, slope, 1e-9);
  }
}

/// Fingers that hold a box stick to it: their speeds are rounding alone, and so is what they cost.
TEST(SlipCost, OfFingersThatHold) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const auto gripper =
      LoadRobot(std::string(CONTACT_FLOW_TEST_DATA) + "/../../config/robots/gripper_friction.yaml");
  const NominalRun& nominal = gripper->nominal();
  TrajectoryProblem problem;
  problem.x = nominal.x;
  problem.duration = 0.3;
  problem.inputs.grid = {0, 0.12, 0.21};
  problem.inputs.values.assign(3, nominal.u);
  problem.effort = Vector::Zero(gripper->num_inputs());
  problem.weight = problem.target = Vector::Zero(gripper->state_size());
  for (int tip = 0; tip < 2; ++tip) {
    problem.slip_weight = Vector::Zero(gripper->num_constraints());
    problem.slip_weight(tip) = 1e3;
    const Unknowns unknowns(*gripper, problem);
    const PieceModels models = MakePieceModels(unknowns, unknowns.Start());
    ASSERT_TRUE(models.status.ok()) << models.status.message;
    EXPECT_LT(models.cost, 1e-20);
    EXPECT_LT(models.pieces.front().gradient.cwiseAbs().maxCoeff(), 1e-10);
  }
}

/// A block that falls onto a shaken plane, slides, lets go, lands again and stops.
class ShakenBlock {
 public:
  explicit ShakenBlock(unsigned seed, bool linear) : random_(seed) {
    system = MakeModel("block_on_incline", {{"incline", Uniform(-0.2, 0.4)},
                                            {"stiffness", Uniform(0, 5)},
                                            {"amplitude", Uniform(0, 3)},
                                            {"frequency", Uniform(3, 8)},
                                            {"normal_amplitude", Uniform(10, 13)},
                                            {"normal_frequency", Uniform(5, 9)},
                                            {"friction", Uniform(0.1, 0.6)}});
    Vector x(6);
    x << Uniform(-0.5, 0.5), Uniform(0.02, 0.1), Uniform(0, 1), Uniform(-2, 2), Uniform(-0.3, 0.1),
        1;
    problem = BlockProblem(x, 1.1, 4);
    for (Vector& u : problem.inputs.values) u(0) = Uniform(-2, 2);
    problem.choose_initial = {0, 1, 2, 3, 4};
    problem.slip_weight = Vector::Constant(1, Uniform(0.5, 2));
    problem.linear_inputs = linear;
    if (linear) problem.input_end = Vector::Constant(1, Uniform(-2, 2));
  }

  std::unique_ptr<MechanicalSystem> system;
  TrajectoryProblem problem;

 private:
  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  std::mt19937 random_;
};

TEST(SlipCost, HasTheSlopesOfPlainRuns) {
  int compared = 0, touchdowns = 0, releases = 0, stops = 0;
  for (unsigned seed = 0; seed < 24; ++seed) {
    ShakenBlock shaken(seed, seed % 2 == 1);
    if (seed % 3 == 0) {
      shaken.problem.choose_durations = {0, 2};
      shaken.problem.keep_horizon = seed % 2 == 0;
    }
    const Unknowns unknowns(*shaken.system, shaken.problem);
    const Vector y = unknowns.Start();
    const PieceModels models = MakePieceModels(unknowns, y);
    ASSERT_TRUE(models.status.ok()) << seed << ": " << models.status.message;
    ASSERT_EQ(1u, models.pieces.size());
    ASSERT_NEAR(CostAt(unknowns, y), models.cost, 1e-9 * (1 + models.cost)) << seed;
    for (const Transition& event : unknowns.Run(y, 1e-12, true).transitions) {
      touchdowns += !event.activated.Empty();
      releases += !event.released.Empty() && event.mode_before.Sticking().Empty();
      stops += event.mode_before.Sticking().Empty() && !event.mode_after.Sticking().Empty() &&
               event.activated.Empty();
    }
    for (int i = 0; i < unknowns.size(); ++i) {
      // Central, extrapolated: an error of order a⁴ and of 1e-12/a by rounding.
      constexpr double a = 2e-4;
      const auto quotient = [&](double step) {
        return (CostAt(unknowns, y + step * Vector::Unit(y.size(), i)) -
                CostAt(unknowns, y - step * Vector::Unit(y.size(), i))) /
               (2 * step);
      };
      const double slope = (4 * quotient(a) - quotient(2 * a)) / 3;
      const double g = models.pieces.front().gradient(i);
      EXPECT_NEAR(slope, g, 1e-6 * (1 + std::abs(g))) << seed << ", unknown " << i;
      ++compared;
    }
  }
  EXPECT_GE(compared, 200);
  EXPECT_GE(touchdowns, 20);
  EXPECT_GE(releases, 10);
  EXPECT_GE(stops, 3);
}

/// A puck in space lands, slips along a curve and stops; by its start.
TEST(SlipCost, OfASlipInSpaceHasTheSlopesOfPlainRuns) {
  const auto puck = MakeModel("puck", {{"gyroscopic", 0.8}, {"drag", 0.3}, {"force_x", 0.2}});
  TrajectoryProblem problem;
  problem.x = Vector::Zero(6);
  problem.x << 0.1, 0.2, 0.05, 0.9, -0.6, 0.2;
  problem.duration = 0.9;
  problem.inputs.grid = {0};
  problem.inputs.values = {Vector()};
  problem.effort = Vector();
  problem.weight = problem.target = Vector::Zero(6);
  problem.choose_initial = {0, 2, 3, 4, 5};
  problem.slip_weight = Vector::Constant(1, 1.5);
  const Unknowns unknowns(*puck, problem);
  const Vector y = unknowns.Start();
  const PieceModels models = MakePieceModels(unknowns, y);
  ASSERT_TRUE(models.status.ok()) << models.status.message;
  ASSERT_EQ(1u, models.pieces.size());
  const Trajectory run = unknowns.Run(y, 1e-12, true);
  ASSERT_EQ(2u, run.transitions.size());  // it lands, and stops
  EXPECT_FALSE(run.arcs.back().mode.Sticking().Empty());
  EXPECT_NEAR(unknowns.Cost(y, run), models.cost, 1e-8 * (1 + models.cost));
  for (int i = 0; i < unknowns.size(); ++i) {
    constexpr double a = 1e-3;
    const auto quotient = [&](double step) {
      return (CostAt(unknowns, y + step * Vector::Unit(y.size(), i)) -
              CostAt(unknowns, y - step * Vector::Unit(y.size(), i))) /
             (2 * step);
    };
    const double slope = (4 * quotient(a) - quotient(2 * a)) / 3;
    const double g = models.pieces.front().gradient(i);
    EXPECT_NEAR(slope, g, 1e-6 * (1 + std::abs(g))) << "unknown " << i;
  }
}

/// To x = 0.3 m at rest, by least effort and slip.
TEST(SlipCost, OptimaAreMinima) {
  const auto block = MakeModel("block_on_incline", {{"incline", 0.1}, {"friction", 0.2}});
  Vector x = Vector::Zero(6);
  x(3) = 0.5;
  x(5) = 1;
  TrajectoryProblem problem = BlockProblem(x, 0.6, 6);
  for (Vector& u : problem.inputs.values) u(0) = 1;
  problem.effort(0) = 0.01;
  problem.weight(0) = problem.weight(3) = 10;
  problem.target(0) = 0.3;
  const TrajectoryOptimum without = OptimizeTrajectory(*block, problem);
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, without.verdict) << without.message;
  problem.slip_weight = Vector::Constant(1, 0.3);
  const TrajectoryOptimum found = OptimizeTrajectory(*block, problem);
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
  EXPECT_GT(found.cost, without.cost);
  const Unknowns unknowns(*block, problem);
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

TEST(SlipCost, MisuseIsRefused) {
  const auto refusal = [](const MechanicalSystem& system, const TrajectoryProblem& problem) {
    try {
      const Unknowns unknowns(system, problem);
    } catch (const std::invalid_argument& reason) {
      return std::string(reason.what());
    }
    return std::string();
  };
  const auto block = MakeModel("block_on_incline");
  const auto ball = MakeModel("driven_ball");
  TrajectoryProblem problem = BlockProblem(block->nominal().x, 1, 2);
  problem.slip_weight = Vector::Ones(2);
  EXPECT_NE(std::string::npos, refusal(*block, problem).find("slip_weight has 2 entries"));
  problem.slip_weight = Vector::Constant(1, -1);
  EXPECT_NE(std::string::npos, refusal(*block, problem).find("slip_weight must be"));
  problem.slip_weight = Vector::Ones(1);
  EXPECT_EQ("", refusal(*block, problem));
  problem.impulse_weight = Vector::Ones(1);
  EXPECT_NE(std::string::npos, refusal(*block, problem).find("impulse_weight"));
  problem.impulse_weight = Vector();
  problem.choose_parameters = {0};
  problem.factory = [](const ParameterValues& values) {
    return MakeModel("block_on_incline", values);
  };
  EXPECT_NE(std::string::npos, refusal(*block, problem).find("by parameters"));
  TrajectoryProblem smooth = BlockProblem(Eigen::Vector2d(1, 0), 1, 2);
  smooth.weight = smooth.target = Vector::Zero(2);
  smooth.slip_weight = Vector::Ones(1);
  EXPECT_NE(std::string::npos, refusal(*ball, smooth).find("'floor' has no friction"));
}

}  // namespace
}  // namespace contact_flow
