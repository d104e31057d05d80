// SPDX-License-Identifier: BSD-3-Clause
// Derivatives of motions that are slow beside others by more than the digits of a number.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

/// Two sliders that know nothing of each other: 1 kg on a spring, 1 g on a hard servo.
RobotTexts Sliders(double stiffness, double hard_stiffness, double hard_damping) {
  const auto slider = [](const std::string& name, double mass) {
    return "<link name='" + name + "'><inertial><mass value='" + std::to_string(mass) +
           "'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>" +
           "<joint name='" + name + "_slide' type='prismatic'><parent link='rail'/><child link='" +
           name + "'/><axis xyz='1 0 0'/><limit effort='1' velocity='1' lower='-9' upper='9'/>" +
           "</joint>";
  };
  const auto spring = [](const std::string& name, double k, double c) {
    return "  " + name + "_spring: {kind: joint_spring, joint: " + name +
           "_slide, stiffness: " + std::to_string(k) + ", damping: " + std::to_string(c) + "}\n";
  };
  RobotTexts texts;
  texts.urdf = "<robot name='sliders'><link name='rail'/>" + slider("easy", 1) +
               slider("hard", 0.001) + "</robot>";
  texts.yaml = "base: fixed\nconstraints: {}\nefforts:\n" + spring("easy", stiffness, 0) +
               spring("hard", hard_stiffness, hard_damping);
  return texts;
}

/// δ of the slow one is a rotation by ω = √k, of the period of 10 minutes, and did not turn at all
/// beside accelerations of 1e10/s² and more.
TEST(ScalesApart, ASlowMotionBesideAHardServo) {
  const double stiffness = 1e-4, omega = std::sqrt(stiffness), duration = 1;
  for (const auto& [hard, damping] : {std::pair(1e5, 1e2), std::pair(1e7, 1e4)}) {
    const auto robot = MakeRobot(Sliders(stiffness, hard, damping));
    const Vector x = (Vector(4) << 0.3, 0, 0.2, 0).finished();
    for (const double tolerance : {1e-7, 1e-9, 1e-10}) {
      SimulateOptions options;
      options.relative_tolerance = options.absolute_tolerance = 1e-11;
      options.dense = true;
      const Trajectory run = Simulate(*robot, x, robot->nominal().u, duration, options);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      BDerivativeOptions asked;
      asked.tolerance = tolerance;
      const BDerivative B = DifferentiateOutcome(*robot, run, asked);
      ASSERT_TRUE(B.status.ok()) << B.status.message;
      const Vector by_position = B(Vector::Unit(4, 0)), by_velocity = B(Vector::Unit(4, 2));
      const double c = std::cos(omega * duration), s = std::sin(omega * duration);
      const double allowed = 10 * tolerance;
      EXPECT_NEAR(c, by_position(0), allowed) << hard << " N/m, tolerance " << tolerance;
      EXPECT_NEAR(-omega * s, by_position(2), allowed) << hard << " N/m, tolerance " << tolerance;
      EXPECT_NEAR(s / omega, by_velocity(0), allowed) << hard << " N/m, tolerance " << tolerance;
      EXPECT_NEAR(c, by_velocity(2), allowed) << hard << " N/m, tolerance " << tolerance;
    }
  }
}

}  // namespace
}  // namespace contact_flow
