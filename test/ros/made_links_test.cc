// SPDX-License-Identifier: BSD-3-Clause
// What is shown of robots with links that no URDF has: soles, and the pads of joints with friction.
#include <gtest/gtest.h>

#include "contact_flow/io/robot_file.h"
#include "src/ros/display/robot_display.h"

namespace contact_flow {
namespace ros_interface {
namespace {

const char* const kUrdf =
    "<robot name='r'><link name='body'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' "
    "iyy='1' iyz='0' izz='1'/></inertial><visual><geometry><sphere "
    "radius='0.2'/></geometry></visual>"
    "</link><link name='foot'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' "
    "iyz='0' izz='1'/></inertial><collision><geometry><sphere radius='0.1'/></geometry></collision>"
    "</link><joint name='knee' type='continuous'><parent link='body'/><child link='foot'/>"
    "<origin xyz='0 0 -0.5'/><axis xyz='0 1 0'/><dynamics friction='0.5'/></joint></robot>";

void ExpectShown(const std::string& yaml) {
  RobotTexts texts;
  texts.urdf = kUrdf;
  texts.yaml = "base: floating\nnominal: {positions: {base_z: 1}}\n" + yaml;
  const auto robot = MakeRobot(texts);
  const RobotDisplay display(*robot, texts.urdf);
  const Vector& x = robot->nominal().x;
  EXPECT_EQ(std::vector<std::string>{"knee"}, display.Joints(x, ros::Time(1)).name) << yaml;
  EXPECT_EQ(1u, display.Ghost(x, "ghost", Color(1, 1, 1, 1)).markers.size()) << yaml;
}

TEST(MadeLinks, OfJointsWithFrictionAreNotShown) { ExpectShown("joints: {friction: all}\n"); }

TEST(MadeLinks, OfSolesAreNotShown) {
  ExpectShown(
      "soles: {foot: {stiffness: 6000, damping: 15, mass: 0.05}}\n"
      "contacts: {ground: [foot_sole]}\n");
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
