// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace contact_flow {

/// The robots of config/robots without friction.
inline std::vector<std::string> ShippedRobots() {
  return {"compliant_quadruped", "gripper",   "hopping_trot", "monoped",
          "planar_biped",        "quadruped", "soft_biped"};
}
/// Those, and two of test/data that have every kind of joint, constraint, effort and parameter.
inline std::vector<std::string> AllRobots() {
  std::vector<std::string> robots = ShippedRobots();
  robots.push_back("everything");
  robots.push_back("everything_controlled");
  return robots;
}
/// The robots with friction, of config/robots and of test/data. Their URDFs are those of others.
inline std::vector<std::string> RobotsWithFriction() {
  return {"everything_with_friction",
          "gripper_friction",
          "humanoid",
          "lifter",
          "planar_biped_friction",
          "quadruped_friction",
          "quadruped_trot",
          "quadruped_trot_feedback",
          "wiper"};
}
/// Path of a robot's YAML.
inline std::string RobotFile(const std::string& robot) {
  const std::string data = CONTACT_FLOW_TEST_DATA;
  return robot.compare(0, 10, "everything") == 0 ? data + "/" + robot + ".yaml"
                                                 : data + "/../../config/robots/" + robot + ".yaml";
}

}  // namespace contact_flow
