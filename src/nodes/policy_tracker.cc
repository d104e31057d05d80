// SPDX-License-Identifier: BSD-3-Clause
#include <ros/ros.h>

#include "src/ros/node/policy_follower.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "policy_tracker");
  return contact_flow::ros_interface::RunPolicyFollower();
}
