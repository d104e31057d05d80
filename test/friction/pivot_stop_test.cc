// SPDX-License-Identifier: BSD-3-Clause
// A body on two of its points, of which one sticks and the other slips about it, until it sticks.
#include <gtest/gtest.h>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

/// Forces of two points that stick are not unique, and those of one share may leave a cone although
/// others hold: the slip never ended where the drift along the line of the points was not below the
/// tolerance, and such a run crept into its budget. Of robot 3003 of scripts/robot_adversary.
TEST(PivotStop, IsMetAtAnyTolerance) {
  const std::string ground =
      "kind: box, link: rock, center: [0.1, 0, 0.05], length: 0.7, width: 0.6, height: 0.1, yaw: "
      "0.3, riser: 0.15, motion: {direction: [0.1234, 0.8204, -0.9455], amplitude: 0.0029, "
      "frequency: 3.194, phase: 5.067}, friction: 0.847";
  RobotTexts texts;
  texts.urdf =
      "<robot name='rock'><link name='rock'><inertial><origin xyz='0.017476 0.00999821 "
      "-0.0191288'/><mass value='0.940304'/><inertia ixx='0.0138208' iyy='0.0228399' "
      "izz='0.0131331' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>";
  texts.yaml =
      "{base: floating, constraints: {low: {" + ground +
      ", point: [-0.1478, 0.1608, -0.1416]}, high: {" + ground +
      ", point: [0.1783, 0.1224, 0.2786]}}, nominal: {positions: {base_z: 0.378}, velocities: "
      "{base_x: 0.7682, base_y: -0.2257, base_z: -0.1219, base_wx: 1.1486, base_wy: 0.776, "
      "base_wz: 0.5329}}}";
  const auto rock = MakeRobot(texts);
  for (const double tolerance : {1e-7, 1e-8, 1e-9, 1e-12}) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    options.max_steps = 2000;
    const Trajectory run = Simulate(*rock, rock->nominal().x, rock->nominal().u, 0.895, options);
    ASSERT_TRUE(run.status.ok()) << tolerance << ": " << run.status.message;
    ASSERT_EQ(4u, run.transitions.size());
    EXPECT_NEAR(0.84524027936, run.transitions.back().t, 1e-10 + 10 * tolerance);
    EXPECT_EQ("ss", run.arcs.back().mode.Word(2));
  }
}

}  // namespace
}  // namespace contact_flow
