// SPDX-License-Identifier: BSD-3-Clause
#include "src/ros/simulator/joint_commands.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>

#include "contact_flow/io/robot_file.h"
#include "test/refusal.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using test::RefusalOf;

void ExpectWords(const std::string& answer, const std::string& words) {
  EXPECT_NE(std::string::npos, answer.find(words)) << "\"" << answer << "\" lacks " << words;
}

/// Joints a (pd), b (servo) and c (actuator with gear 4).
const RobotSystem& Robot() {
  static const RobotSystem* const robot = [] {
    std::string urdf = "<robot name=\"r\"><link name=\"world\"/>";
    for (const std::string name : {"a", "b", "c"}) {
      urdf += "<link name=\"l" + name + "\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" "
              "iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>";
      urdf += "<joint name=\"" + name +
              "\" type=\"continuous\"><parent link=\"world\"/><child link=\"l" + name +
              "\"/></joint>";
    }
    return new RobotSystem(
        ParseRobot(urdf + "</robot>",
                   YAML::Load("{efforts: {x: {kind: pd, joint: a, position: p, velocity: v, "
                              "feed_forward: f, stiffness: 1}, y: {kind: servo, joint: b, input: "
                              "s, stiffness: 1}, z: {kind: actuator, joint: c, input: u, gear: "
                              "4}}}")),
        {});
  }();
  return *robot;
}

TEST(JointCommands, BecomeInputsByTheEffortsOfTheJoints) {
  const JointCommands joints(Robot());
  sensor_msgs::JointState command;
  command.name = {"a"};
  command.position = {1};
  command.velocity = {2};
  command.effort = {3};
  NamedInputs inputs = joints.Inputs(command);
  EXPECT_EQ((std::vector<std::string>{"p", "v", "f"}), inputs.names);
  EXPECT_EQ((std::vector<double>{1, 2, 3}), inputs.values);
  command = sensor_msgs::JointState();
  command.name = {"a", "c"};
  command.effort = {5, 8};
  inputs = joints.Inputs(command);
  EXPECT_EQ((std::vector<std::string>{"f", "u"}), inputs.names);
  EXPECT_EQ((std::vector<double>{5, 2}), inputs.values);
  command.name = {"b"};
  command.effort = {1};
  ExpectWords(RefusalOf([&] { joints.Inputs(command); }), "joint 'b' takes no efforts");
  command.name = {"d"};
  ExpectWords(RefusalOf([&] { joints.Inputs(command); }), "unknown driven joint 'd'");
  command.name = {"a", "c"};
  ExpectWords(RefusalOf([&] { joints.Inputs(command); }), "1 efforts, expected 2");
}

TEST(JointCommands, NumbersAreAllInputsInTheirOrder) {
  std_msgs::Float64MultiArray command;
  command.data = {9, 1, 2};
  command.layout.data_offset = 1;
  EXPECT_EQ((std::vector<double>{1, 2}), ToInputs(command, {"a", "b"}).values);
  ExpectWords(RefusalOf([&] { ToInputs(command, {"a"}); }), "2 numbers, expected 1");
  command.layout.data_offset = 4;
  ExpectWords(RefusalOf([&] { ToInputs(command, {"a"}); }), "beyond the data");
}

/// From 0.5 to 1 in a second, then by the cubic t³ from 1 to 8 in another, rates 3 and 12.
TEST(TrajectoryFollower, GoesStraightOrAlongCubics) {
  const JointCommands joints(Robot());
  trajectory_msgs::JointTrajectory trajectory;
  trajectory.joint_names = {"a", "b"};
  trajectory.points.resize(2);
  trajectory.points[0].positions = {1, 10};
  trajectory.points[0].time_from_start = ros::Duration(1);
  trajectory.points[1].positions = {8, 20};
  trajectory.points[1].time_from_start = ros::Duration(2);
  const TrajectoryFollower straight(trajectory, 5, {0.5, 4}, joints);
  NamedInputs inputs = straight.At(5.25);
  EXPECT_EQ((std::vector<std::string>{"p", "v", "s"}), inputs.names);
  EXPECT_EQ((std::vector<double>{0.625, 0.5, 5.5}), inputs.values);
  EXPECT_EQ((std::vector<double>{0.5, 0, 4}), straight.At(3).values);
  EXPECT_EQ((std::vector<double>{8, 0, 20}), straight.At(7.5).values);
  EXPECT_FALSE(straight.Done(6.9));
  EXPECT_TRUE(straight.Done(7));
  trajectory.points[0].velocities = {3, 0};
  trajectory.points[1].velocities = {12, 0};
  inputs = TrajectoryFollower(trajectory, 5, {0.5, 4}, joints).At(6.5);
  EXPECT_NEAR(1.5 * 1.5 * 1.5, inputs.values[0], 1e-14);
  EXPECT_NEAR(3 * 1.5 * 1.5, inputs.values[1], 1e-14);
  trajectory.points[1].time_from_start = ros::Duration(1);
  const auto make = [&] { TrajectoryFollower(trajectory, 5, {0.5, 4}, joints); };
  ExpectWords(RefusalOf(make), "point 2 of the trajectory is not after");
  trajectory.points[0].positions = {1};
  ExpectWords(RefusalOf(make), "1 positions in point 1, expected 2");
  trajectory.joint_names = {"a", "c"};
  ExpectWords(RefusalOf(make), "joint 'c' takes no positions");
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
