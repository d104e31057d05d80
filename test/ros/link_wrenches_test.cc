// SPDX-License-Identifier: BSD-3-Clause
// Wrenches on links: on the link that a contact names, and as much the other way on the other one.
#include <gtest/gtest.h>

#include "contact_flow/io/robot_file.h"
#include "src/ros/display/robot_display.h"

namespace contact_flow {
namespace ros_interface {
namespace {

std::string Link(const std::string& name) {
  return "<link name='" + name +
         "'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' "
         "iyy='1' iyz='0' izz='1'/></inertial></link>";
}

TEST(LinkWrenches, AreOnTheLinksThatConstraintsName) {
  RobotTexts texts;
  texts.urdf = "<robot name='r'>" + Link("foot") + Link("camera") + Link("lid") +
               "<joint name='mount' type='fixed'><parent link='foot'/><child link='camera'/>"
               "<origin xyz='1 0 0'/></joint>"
               "<joint name='slide' type='prismatic'><parent link='foot'/><child link='lid'/>"
               "<origin xyz='0 0 2'/><axis xyz='0 0 1'/><limit lower='-9' upper='9' effort='1' "
               "velocity='1'/></joint></robot>";
  texts.yaml =
      "base: floating\n"
      "constraints:\n"
      "  toe: {kind: plane, link: foot, point: [0.9, 0, 0]}\n"  // beside the camera
      "  rest: {kind: link_plane, link: lid, other_link: foot, normal: [0, 0, 1]}\n";
  const auto robot = MakeRobot(texts);
  const RobotDisplay display(*robot, texts.urdf);
  ASSERT_EQ((std::vector<std::string>{"foot", "lid"}), display.touching_links());
  Vector force = Vector::Zero(robot->num_rows());
  force << 7, 3;
  const auto wrenches = display.LinkWrenches(robot->nominal().x, force, ros::Time(1));
  ASSERT_EQ(2u, wrenches.size());
  EXPECT_EQ("foot", wrenches[0].header.frame_id);
  EXPECT_NEAR(7 - 3, wrenches[0].wrench.force.z, 1e-12) << "the ground lifts, the lid presses";
  EXPECT_NEAR(-0.9 * 7, wrenches[0].wrench.torque.y, 1e-12);
  EXPECT_NEAR(3, wrenches[1].wrench.force.z, 1e-12);
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
