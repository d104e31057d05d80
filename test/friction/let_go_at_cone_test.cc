// SPDX-License-Identifier: BSD-3-Clause
// A leg on whose toe a body swings over: its stick force reaches the cone where slip would press
// the toe into the ground, so that it lets go at once. The force jumps to zero there.
#include <gtest/gtest.h>

#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/friction/confirmed.h"

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

}  // namespace
}  // namespace contact_flow
