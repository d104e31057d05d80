// SPDX-License-Identifier: BSD-3-Clause
// Writes the policy that a node has made, as YAML.
#include <ros/ros.h>

#include <exception>
#include <fstream>
#include <iostream>
#include <string>

#include "contact_flow/io/policy_file.h"
#include "src/ros/request/policy_messages.h"

namespace contact_flow {
namespace {

constexpr double kPatience = 10;  // [s]

int Run(const std::string& node, const std::string& path) {
  const std::string topic = node + "/policy";
  const auto message = ros::topic::waitForMessage<Policy>(topic, ros::Duration(kPatience));
  if (!message) {
    std::cerr << "save_policy: no policy on " << topic << ": call " << node << "/make_policy\n";
    return 1;
  }
  std::ofstream out(path);
  WritePolicy(ros_interface::FromMsg(*message), &out);
  out.close();
  if (!out) {
    std::cerr << "save_policy: " << path << " cannot be written\n";
    return 1;
  }
  std::cout << path << "\n";
  return 0;
}

}  // namespace
}  // namespace contact_flow

int main(int argc, char** argv) {
  ros::init(argc, argv, "save_policy", ros::init_options::AnonymousName);
  if (argc != 3) {
    std::cerr << "usage: save_policy NODE FILE.yaml\n";
    return 2;
  }
  try {
    const ros::NodeHandle handle;
    return contact_flow::Run(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::cerr << "save_policy: " << error.what() << "\n";
    return 1;
  }
}
