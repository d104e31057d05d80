// SPDX-License-Identifier: BSD-3-Clause
// A toe that sticks until its force reaches the cone, where no slip has forces: it lets go with
// 8 N, so that the acceleration jumps at an instant that perturbations move.
#include <gtest/gtest.h>

#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/robot_twins.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

TEST(StickBursts, LettingGoAtTheConeIsSmooth) {
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
