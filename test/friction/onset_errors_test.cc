// SPDX-License-Identifier: BSD-3-Clause
// Errors of runs in which a slip in space begins.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/robot_twins.h"
#include "test/friction/systems/drawn_contacts.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

constexpr double kSlipTime = 0.03;  // [s] behind the onset

/// A carriage of mass 50, free in the plane, to which the mass is tied by a bushing.
std::string Carriage(const std::string& name) {
  return test::Link(name + "x", 0, 0, 0, 0) + test::Link(name, 50, 1, 1, 1) +
         test::Slide(name + "_x", "world", name + "x", "1 0 0") +
         test::Slide(name + "_y", name + "x", name, "0 1 0");
}

/// A mass on the ground, pulled by bushings to two carriages that drive away, until it slips.
struct PulledMass {
  std::unique_ptr<RobotSystem> robot;
  Vector x;
  double onset = 0;  // [s]

  explicit PulledMass(unsigned seed) {
    test::Dice dice(seed);
    const auto bushing = [&](const std::string& to) {
      return to + ": {kind: frame_spring, link: mass, other_link: " + to +
             ", stiffness: " + std::to_string(std::exp(dice.Uniform(4, 8))) +
             ", damping: " + std::to_string(dice.Uniform(0, 4)) +
             ", turn_stiffness: 0, turn_damping: 0}";
    };
    const std::string a = bushing("a"), b = bushing("b");
    robot = test::Robot(
        "<robot name='r'><link name='world'/>" + test::OnSlides("mass", dice.Uniform(0.3, 3)) +
            Carriage("a") + Carriage("b") + "</robot>",
        "{base: fixed, gravity: 9.81, constraints: {foot: {kind: plane, link: mass, point: [0, 0, "
        "0], friction: " +
            std::to_string(dice.Uniform(0.2, 1)) + "}}, efforts: {" + a + ", " + b + "}}");
    const std::vector<std::string>& names = robot->description().velocities;
    x = Vector::Zero(2 * robot->dof());
    for (std::size_t k = 0; k < names.size(); ++k) {
      const bool drives = names[k].rfind("mass", 0) != 0;
      if (drives) x(robot->dof() + static_cast<int>(k)) = dice.Uniform(-0.5, 0.5);
    }
    const Trajectory run = Simulate(*robot, x, Vector(), 1.0, test::AtTolerance(1e-9));
    for (const Transition& event : run.transitions) {
      if (onset == 0 && event.mode_after.Word(1) == "l") onset = event.t;
    }
  }

  Trajectory Run(double tolerance, IntegrationMethod method) const {
    SimulateOptions options = test::AtTolerance(tolerance);
    options.method = method;
    options.dense = true;
    return Simulate(*robot, x, Vector(), onset + kSlipTime, options);
  }
};

/// What the slip is given to begin with, ten tolerances, is told. It was 50 to 4000 times as much
/// as was told.
TEST(OnsetErrors, AreTold) {
  int count = 0;
  for (unsigned seed = 1; seed <= 15; ++seed) {
    const PulledMass pulled(seed);
    if (pulled.onset == 0) continue;
    ++count;
    const Vector exact = pulled.Run(1e-13, IntegrationMethod::kExplicit).FinalState();
    for (const double tolerance : {1e-7, 1e-9, 1e-11}) {
      const Trajectory run = pulled.Run(tolerance, IntegrationMethod::kAutomatic);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      const BDerivative B = DifferentiateOutcome(*pulled.robot, run);
      ASSERT_TRUE(B.status.ok()) << B.status.message;
      const Vector error = (run.FinalState() - exact).cwiseAbs(), &told = B.trust.state_error;
      for (int k = 0; k < error.size(); ++k) EXPECT_LE(error(k), 2 * told(k) + 1e-13) << seed;
      EXPECT_LT(told.maxCoeff(), 100 * error.maxCoeff()) << seed << ' ' << tolerance;
    }
  }
  EXPECT_GT(count, 5);
}

/// An implicit step of 2e-3 s from the onset on was 6e-7 off, at tolerance 1e-12.
TEST(OnsetErrors, ImplicitStepsFollowTheTurn) {
  for (unsigned seed = 1; seed <= 15; ++seed) {
    const PulledMass pulled(seed);
    if (pulled.onset == 0) continue;
    const Trajectory run = pulled.Run(1e-12, IntegrationMethod::kImplicit);
    const Trajectory exact = pulled.Run(1e-13, IntegrationMethod::kExplicit);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    EXPECT_LT((run.FinalState() - exact.FinalState()).cwiseAbs().maxCoeff(), 1e-10) << seed;
  }
}

}  // namespace
}  // namespace contact_flow
