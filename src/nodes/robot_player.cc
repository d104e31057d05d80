// SPDX-License-Identifier: BSD-3-Clause
#include "src/ros/node/robot_player.h"

#include <ros/ros.h>

int main(int argc, char** argv) {
  ros::init(argc, argv, "robot_player");
  return contact_flow::ros_interface::RunRobotPlayer();
}
