// SPDX-License-Identifier: BSD-3-Clause
// Ground that moves is shown where it is at that time, in a frame of its own.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/rigid_body/terrain_surface.h"
#include "src/ros/display/robot_display.h"

namespace contact_flow {
namespace ros_interface {
namespace {

TEST(MovingTerrain, IsShownWhereItIs) {
  RobotTexts texts;
  texts.urdf =
      "<robot name='r'><link name='foot'><inertial><mass value='1'/><inertia ixx='1' ixy='0' "
      "ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link></robot>";
  texts.yaml =
      "base: floating\n"
      "constraints:\n"
      "  floor: {kind: plane, link: foot, offset: -1}\n"
      "  table: {kind: plane, link: foot, motion: {direction: [0, 0, 1], amplitude: 0.1, "
      "frequency: 2}}\n"
      "  corner: {kind: plane, link: foot, point: [0.1, 0, 0], motion: {direction: [0, 0, 1], "
      "amplitude: 0.1, frequency: 2}}\n"
      "  belt: {kind: plane, link: foot, offset: -0.5, motion: {direction: [1, 0, 0], velocity: "
      "3}}\n"
      "nominal: {positions: {base_z: 1}}\n";
  const auto robot = MakeRobot(texts);
  const RobotDisplay display(*robot, texts.urdf);
  const auto markers = display.Terrain().markers;
  ASSERT_EQ(3u, markers.size()) << "the table once";
  EXPECT_EQ("odom", markers[0].header.frame_id);
  EXPECT_EQ("terrain_2", markers[1].header.frame_id);
  EXPECT_TRUE(markers[1].frame_locked);
  EXPECT_EQ("terrain_3", markers[2].header.frame_id);
  Vector x = robot->nominal().x;
  x(robot->robot().model.ClockCoordinate().q) = 0.37;
  const auto transforms = display.Transforms(x, ros::Time(1));
  ASSERT_EQ(3u, transforms.size());
  EXPECT_EQ("base_link", transforms[0].child_frame_id);
  EXPECT_EQ("terrain_2", transforms[1].child_frame_id);
  EXPECT_EQ("odom", transforms[1].header.frame_id);
  EXPECT_NEAR(0.1 * std::sin(4 * M_PI * 0.37), transforms[1].transform.translation.z, 1e-12);
  // Its pattern, of 0.4 m, is where the belt is; its picture does not leave.
  const double shown = transforms[2].transform.translation.x;
  EXPECT_NEAR(0, std::remainder(3 * 0.37 - shown, 0.4), 1e-12);
  EXPECT_LE(std::abs(shown), 0.2 + 1e-12);
  EXPECT_EQ(0, transforms[2].transform.translation.z);
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
