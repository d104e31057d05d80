// SPDX-License-Identifier: BSD-3-Clause
#include <ros/ros.h>

#include "contact_flow/ros/run_node.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "contact_flow");
  return contact_flow::ros_interface::RunNode();
}
