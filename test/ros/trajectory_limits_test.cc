// SPDX-License-Identifier: BSD-3-Clause
// Where efforts pass their limits, in the message of a run.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "src/ros/message/conversions.h"

namespace contact_flow {
namespace ros_interface {
namespace {

const char kCart[] = R"(<robot name="cart"><link name="world"/>
<link name="cart"><inertial><mass value="2"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="x" type="prismatic"><parent link="world"/><child link="cart"/><axis xyz="1 0 0"/>
  <limit lower="-9" upper="9" effort="9" velocity="9"/></joint></robot>)";

/// 4 m/s² from rest up to 0.6 m, where the servo leaves its limit.
TEST(TrajectoryLimits, AreToldWithTheirArcs) {
  const RobotSystem system(
      ParseRobot(kCart, YAML::Load("{efforts: {drive: {kind: servo, joint: x, input: u, "
                                   "stiffness: 20, limit: 8}}, nominal: {inputs: {u: 1}}}")),
      {});
  const Trajectory run = Simulate(system, system.nominal().x, system.nominal().u, 0.8);
  ContactTrajectory message = ToMsg(system.description(), run, 0.8, 10);
  AddLimits(system, run, &message);
  ASSERT_EQ(1u, message.arcs.size());
  ASSERT_EQ(1u, message.arcs[0].limits.size());
  const LimitInstant& passing = message.arcs[0].limits[0];
  EXPECT_NEAR(std::sqrt(0.3), passing.t, 1e-9);
  EXPECT_EQ("drive", passing.effort);
  EXPECT_EQ("upper", passing.before);
  EXPECT_EQ("free", passing.after);
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
