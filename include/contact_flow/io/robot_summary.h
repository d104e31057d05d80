// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/io/robot_file.h"

namespace contact_flow {

/// A robot as a YAML for a person to edit: warnings, links and joints as comments; contacts that
/// were made, written out; where it starts. `document` is the YAML it was made from. Reading the
/// answer beside the same URDF gives the same robot.
std::string DescribeRobot(const RobotDescription& robot, const YAML::Node& document,
                          const std::string& urdf_path, const std::string& folder);

}  // namespace contact_flow
