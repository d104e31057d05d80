// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "urdf_xml.h"

namespace contact_flow {

/// Puts into `text`, whose places `root` knows, what urdfdom does not do without although nothing
/// here depends on it: a name of the robot, the link world, limits of joints and their efforts and
/// velocities. What was done, with joint and line.
std::vector<std::string> RepairUrdf(const XmlElement& root, std::string* text);

}  // namespace contact_flow
