// SPDX-License-Identifier: BSD-3-Clause
// Contacts whose stick force reaches the cone where slip would press them into the ground: they let
// go at once, and the force jumps to zero, at an instant that perturbations move.
#include <gtest/gtest.h>

#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/friction/confirmed.h"
#include "test/friction/robot_twins.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

constexpr const char* kStilt =
    "<robot name=\"stilt\"><link name=\"body\"><inertial><origin xyz=\"-0.045 0 0.022\"/>"
    "<mass value=\"2.6\"/><inertia ixx=\"0.037\" iyy=\"0.034\" izz=\"0.018\" ixy=\"0\" ixz=\"0\" "
    "iyz=\"0\"/></inertial></link><link name=\"leg\"><inertial><origin xyz=\"-0.012 0 -0.11\"/>"
    "<mass value=\"0.91\"/><inertia ixx=\"0.006\" iyy=\"0.005\" izz=\"0.009\" ixy=\"0\" ixz=\"0\" "
    "iyz=\"0\"/></inertial></link><joint name=\"hip\" type=\"continuous\"><parent link=\"body\"/>"
    "<child link=\"leg\"/><origin xyz=\"0 0 -0.06\" rpy=\"0 -0.125 0\"/><axis xyz=\"0 1 0\"/>"
    "</joint></robot>";

std::unique_ptr<RobotSystem> MakeStilt(const ParameterValues& values) {
  RobotTexts texts;
  texts.urdf = kStilt;
  texts.yaml =
      "base: planar\nconstraints:\n  toe: {kind: plane, link: leg, point: [0.01, 0, -0.2], normal: "
      "[0.19, 0, 1], offset: 0.71, friction: 0.9}\nefforts:\n  hip: {kind: servo, joint: hip, "
      "input: setpoint, stiffness: 38, damping: "
      "0.68, limit: 3.97}\nparameters: {friction: toe/friction, mass: links/body/mass}\n"
      "nominal:\n  positions: {base_x: 0.1, base_z: 1, base_pitch: 0.365, hip: 0.22}\n"
      "  velocities: {hip: 0.64, base_x: 0.61, base_z: -0.64, base_pitch: -1.14}\n"
      "  inputs: {setpoint: 0.136}\n";
  return MakeRobot(texts, values);
}

/// A body swings over on its leg.
TEST(LetGoAtCone, HasTheDerivativeOfItsInstant) {
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-11;
  const auto factory = [](const ParameterValues& values) { return MakeStilt(values); };
  for (const double friction : {0.9, 1.2}) {
    const auto stilt = MakeStilt({{"friction", friction}});
    const NominalRun& start = stilt->nominal();
    const double duration = 0.2;
    const Trajectory run = Simulate(*stilt, start.x, start.u, duration, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(2u, run.transitions.size());
    const Transition& release = run.transitions.back();
    ASSERT_EQ("s", release.mode_before.Word(1));
    ASSERT_TRUE(release.mode_after.Empty());
    ContactDynamics before(*stilt, start.u);
    before.Evaluate(release.x_minus, release.mode_before);
    ASSERT_GT(before.force()(0), 1);  // [N]
    BDerivativeOptions by;
    by.variables = {true, {0, 1}};
    const BDerivative B = DifferentiateOutcome(*stilt, run, by);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    const int size = 2 * stilt->dof() + by.variables.Size(*stilt);
    for (int k = 0; k < size; ++k) {
      for (const double sign : {1.0, -1.0}) {
        const Vector w = sign * Vector::Unit(size, k);
        const QuotientReport report = CompareWithQuotients(
            *stilt, factory, by.variables, start.x, InputSchedule::Constant(start.u), duration, w,
            B(w), {1e-3, 1e-4, 1e-5}, options);
        test::ExpectConfirmed(report, B, w);
      }
    }
  }
}

/// A leg of two links, behind a change of its inputs: its toe carries 8 N where it lets go.
TEST(LetGoAtCone, BehindAChangeOfTheInput) {
  const auto link = [](const char* name, double mass, double inertia, double z) {
    const std::string i = std::to_string(inertia);
    return "<link name='" + std::string(name) + "'><inertial><origin xyz='0 0 " +
           std::to_string(z) + "'/><mass value='" + std::to_string(mass) + "'/><inertia ixx='" + i +
           "' iyy='" + i + "' izz='" + i + "' ixy='0' ixz='0' iyz='0'/></inertial></link>";
  };
  const auto robot = test::Robot(
      "<robot name='leg'>" + link("body", 5, 0.05, 0) + link("thigh", 0.8, 0.01, -0.17) +
          link("shank", 0.5, 0.006, -0.15) +
          "<joint name='hip' type='continuous'><parent link='body'/><child link='thigh'/><axis "
          "xyz='0 1 0'/></joint><joint name='knee' type='continuous'><parent link='thigh'/><child "
          "link='shank'/><origin xyz='0 0 -0.35'/><axis xyz='0 1 0'/></joint></robot>",
      "base: planar\ngravity: 9.81\nconstraints: {toe: {kind: plane, link: shank, point: [0, 0, "
      "-0.35], friction: 0.8}}\nefforts:\n  h: {kind: servo, joint: hip, input: a, stiffness: 120, "
      "damping: 4}\n  k: {kind: servo, joint: knee, input: b, stiffness: 120, damping: 4}\n"
      "nominal:\n  positions: {base_z: 0.72, base_pitch: 0.1, hip: 0.3, knee: -0.6}\n  velocities: "
      "{base_x: 0.5, base_z: -0.3, knee: 0.2}\n");
  const Vector x = robot->nominal().x;
  const InputSchedule schedule{{0, 0.1}, {test::Entries({0.3, -0.6}), test::Entries({0.5, -0.4})}};
  const auto from = [&](const Vector& start) {
    return Simulate(*robot, start, schedule, 0.157, test::AtTolerance(1e-12));
  };
  const Trajectory run = from(x);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const Transition& last = run.transitions.back();
  ASSERT_EQ("s", last.mode_before.Word(1));
  ASSERT_EQ("o", last.mode_after.Word(1));
  const BDerivative B = DifferentiateOutcome(*robot, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  constexpr double kStep = 1e-6;
  for (int j = 0; j < 2 * robot->dof(); ++j) {
    for (const double sign : {1., -1.}) {
      const Vector w = sign * Vector::Unit(2 * robot->dof(), j), told = B(w);
      const Vector moved = from(robot->Perturb(x, kStep * w)).FinalState();
      const Vector quotient = robot->Separation(moved, run.FinalState()) / kStep;
      EXPECT_LE((quotient - told).cwiseAbs().maxCoeff(), 3e-4 * (1 + told.cwiseAbs().maxCoeff()))
          << j << ' ' << sign;
    }
  }
}

}  // namespace
}  // namespace contact_flow
