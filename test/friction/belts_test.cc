// SPDX-License-Identifier: BSD-3-Clause
// A box that sticks to two belts: which of them carries it on is decided by friction where their
// speeds differ, and no derivative is told then.
#include <gtest/gtest.h>

#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/derivative/linearization.h"
#include "contact_flow/derivative/start_directions.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/piecewise_linear/linear_program.h"

namespace contact_flow {
namespace {

constexpr double kBeltSpeed = 0.5, kBeltTime = 0.5;  // of the belts [m/s], of runs [s]

struct Belts {
  std::string left = "0.3", right = "0.8";  // friction
  bool together = false;                    // one parameter for both speeds
  double size = 1;                          // of a metre
  double pull = 0;                          // along the belts, in weights

  std::unique_ptr<RobotSystem> Make(const ParameterValues& values = {}) const {
    RobotTexts texts;
    std::ostringstream urdf, yaml;
    urdf << "<robot name=\"r\"><link name=\"b\"><inertial><origin xyz=\"" << 0.02 * size
         << " 0 0\"/><mass value=\"1\"/><inertia ixx=\"" << 0.01 * size * size << "\" iyy=\""
         << 0.02 * size * size << "\" izz=\"" << 0.015 * size * size
         << "\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link></robot>";
    yaml << "base: planar\ngravity: " << 9.81 * size << "\nconstraints:\n";
    for (const char* foot : {"left", "right"}) {
      const bool first = foot == std::string("left");
      yaml << "  " << foot << ": {kind: plane, link: b, point: [" << (first ? -0.1 : 0.1) * size
           << ", 0, " << -0.05 * size << "], friction: " << (first ? left : right)
           << ", motion: {direction: [1, 0, 0], velocity: " << kBeltSpeed * size << "}}\n";
    }
    yaml << "efforts: {pull: {kind: constant_force, link: b, force: [" << pull * 9.81 * size
         << ", 0, 0]}}\n"
         << (together ? "parameters: {v: [left/motion_velocity, right/motion_velocity]}\n"
                      : "parameters: {v1: left/motion_velocity, v2: right/motion_velocity}\n");
    texts.urdf = urdf.str();
    texts.yaml = yaml.str();
    return MakeRobot(texts, values);
  }

  /// On the belts, at this speed.
  Vector Start(const MechanicalSystem& system, double speed) const {
    Vector x = system.nominal().x;  // with the clock of the belts
    x(1) = 0.05 * size;
    x(system.num_positions()) = speed * size;
    return x;
  }
};

BDerivative ByAll(const MechanicalSystem& system, const Trajectory& run) {
  BDerivativeOptions options;
  for (std::size_t k = 0; k < system.description().parameters.size(); ++k) {
    options.variables.parameters.push_back(static_cast<int>(k));
  }
  return DifferentiateOutcome(system, run, options);
}

Trajectory RunOnBelts(const MechanicalSystem& system, const Vector& x) {
  return Simulate(system, x, Vector(0), kBeltTime, SimulateOptions());
}

class BoxOnBelts : public testing::TestWithParam<std::tuple<double, double>> {};

/// At rest on the belts, or coming to rest on them: by one speed alone, either way, no derivative
/// is told, and by both that of the runs around.
TEST_P(BoxOnBelts, TellsNoDerivativeByOneSpeed) {
  const auto& [speed, size] = GetParam();
  Belts belts;
  belts.size = size;
  const auto system = belts.Make();
  const Trajectory run = RunOnBelts(*system, belts.Start(*system, speed));
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ("ss", run.arcs.back().mode.Word(2));
  const BDerivative B = ByAll(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_FALSE(B.IsDifferentiable());
  EXPECT_EQ(Outcome::kNotPiecewiseLinear, B.PiecewiseLinear().outcome);
  EXPECT_THROW(B.Pieces(), NotPiecewiseLinear);
  for (const double by : {1.0, -1.0}) {
    for (const int which : {0, 1}) {
      Vector w = Vector::Zero(10);
      w(8 + which) = by;
      try {
        B(w);
        ADD_FAILURE() << which << ' ' << by;
      } catch (const std::domain_error& reason) {
        EXPECT_NE(std::string::npos, std::string(reason.what()).find("left")) << reason.what();
      }
    }
  }
  Vector both = Vector::Zero(10);
  both.tail(2).setOnes();
  const double alpha = 1e-5 * size;
  const auto moved =
      belts.Make({{"v1", kBeltSpeed * size + alpha}, {"v2", kBeltSpeed * size + alpha}});
  const Trajectory other = RunOnBelts(*moved, belts.Start(*moved, speed));
  const Vector quotient = (other.FinalState() - run.FinalState()) / alpha;
  EXPECT_LT((quotient - B(both)).cwiseAbs().maxCoeff(), 1e-4);
}

INSTANTIATE_TEST_SUITE_P(FromRestAndSlip, BoxOnBelts,
                         testing::Combine(testing::Values(0.5, 0.3), testing::Values(1.0, 1e-3)));

/// A force pulls the box back that slides against it on both belts: its slips end at once, and
/// begin again the other way. Where the belts differ a little, one foot is turned before the other,
/// and between the two friction is that of neither word. No stop is in sight: each belt has its
/// derivative, on either side.
TEST(Belts, SlipsThatTurnOneAfterTheOther) {
  Belts belts;
  belts.left = "0.1";
  belts.right = "0.3";
  belts.pull = -0.6;
  const auto system = belts.Make();
  const Vector x = belts.Start(*system, 1.2);
  const Trajectory run = RunOnBelts(*system, x);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  ASSERT_EQ("++", run.arcs[0].mode.Word(2));
  ASSERT_EQ("--", run.arcs[1].mode.Word(2));
  const BDerivative B = ByAll(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  constexpr double kStep = 1e-6;
  for (const double by : {1.0, -1.0}) {
    for (const char* which : {"v1", "v2"}) {
      Vector w = Vector::Zero(10);
      w(which == std::string("v1") ? 8 : 9) = by;
      const auto moved = belts.Make({{which, kBeltSpeed + kStep * by}});
      const Trajectory other = RunOnBelts(*moved, x);
      ASSERT_EQ(3u, other.arcs.size()) << which << ' ' << by;
      const Vector quotient = (other.FinalState() - run.FinalState()) / kStep;
      EXPECT_LT((quotient - B(w)).cwiseAbs().maxCoeff(), 1e-4) << which << ' ' << by << "\n"
                                                               << quotient.transpose() << "\n"
                                                               << B(w).transpose();
    }
  }
}

/// What one belt does to the box is no part of a gradient; what both do is.
TEST(Belts, GradientIsByBothSpeeds) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  RunCost cost;
  cost.terminal = [](const Vector& x, Vector* by_state) {
    *by_state = Vector::Unit(x.size(), 0);
    return x(0);
  };
  for (const bool together : {false, true}) {
    Belts belts;
    belts.together = together;
    const auto system = belts.Make();
    const Trajectory run = RunOnBelts(*system, belts.Start(*system, kBeltSpeed));
    BDerivativeOptions options;
    options.variables.parameters = {0};
    if (!together) options.variables.parameters.push_back(1);
    const CostGradient gradient = DifferentiateCost(*system, run, cost, options, nullptr);
    EXPECT_EQ(together, gradient.status.ok()) << gradient.status.message;
    if (together) EXPECT_NEAR(kBeltTime, gradient.parameters(0), 1e-9);
  }
}

/// Feet that never slip: no start follows one belt.
TEST(Belts, StartsOfFeetThatNeverSlip) {
  Belts belts;
  belts.left = belts.right = "no_slip";
  const auto system = belts.Make();
  const Vector x = belts.Start(*system, kBeltSpeed);
  const ContactMode mode = InitialMode(*system, x, Vector(0));
  Variables variables;
  variables.parameters = {0, 1};
  const StartDirections starts(*system, x, mode, StartCone(), variables);
  Vector one = Vector::Zero(10), both = Vector::Zero(10);
  one(8) = 1;
  both.tail(2).setOnes();
  EXPECT_FALSE(starts.Judge(starts.Project(one)).ok());
  EXPECT_TRUE(starts.Judge(starts.Project(both)).ok());
}

}  // namespace
}  // namespace contact_flow
