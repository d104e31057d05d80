// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/model/rigid_body/robot_model.h"

namespace contact_flow {

/// Limits of what is read, far above any robot: a larger text is refused before it is parsed.
constexpr std::size_t kMaxUrdfBytes = 4u << 20;
constexpr int kMaxUrdfLinks = 1000;
constexpr int kMaxUrdfDepth = 100;

/// How faults of a URDF that hardly matter are taken.
enum class UrdfFaults {
  kLenient,  ///< repaired, with a warning that names the link and the change
  kStrict,   ///< refused
};
/// "lenient", "strict".
const std::vector<std::string>& UrdfFaultsNames();

/// A robot from the text of a URDF, read by urdfdom. Joints: revolute, continuous, prismatic, fixed
/// (its links become one body), planar and floating. Numbers come in the order of the tree,
/// children by the alphabet of their joints. Each is called as its joint; those of a planar joint J
/// are J_x, J_y, J_angle; of a floating one J_x, J_y, J_z, J_qw, J_qx, J_qy, J_qz.
///
/// Inertia is judged on bodies, that is on links rigidly joined; what is fixed to the world is not
/// judged. A link whose body has an inertia that is not positive definite gets the nearest that a
/// body can have, where it is off by at most kMaxInertiaRepair; else it is refused. One that is
/// positive definite, but of no distribution of mass (a principal moment above the sum of the
/// others), is used as it is. Mass zero is nothing, whatever its inertia; inertia zero is a point.
/// A joint that moves no mass is held at zero: nothing else feels it. All this is told in
/// `warnings`, as are tags and attributes of links and joints that nothing is known to read; and
/// limits, damping and friction of joints, which are for others. A mimic joint goes into `mimics`.
///
/// Only links, their inertials and collisions, and joints are read. Everything else throws one
/// std::invalid_argument with all findings, each with link or joint and what to do: text that is no
/// URDF, loops, loose parts, numbers that are none, and mechanics that has no answer.
RobotModel ParseUrdf(const std::string& text, RobotBase base,
                     UrdfFaults faults = UrdfFaults::kLenient);

/// Largest repair: a negative principal moment beside the largest one.
constexpr double kMaxInertiaRepair = 0.1;

/// The same URDF with links and joints alone, which urdfdom reads although it may refuse the whole
/// for a visual or a transmission that it does not like. For texts that ParseUrdf has taken.
std::string UrdfStructure(const std::string& text);

/// Throws std::invalid_argument for a text that is too long, too deep, has too many links, or bytes
/// that are not of any XML: what a parser should not be trusted with.
void CheckUrdfText(const std::string& text);

}  // namespace contact_flow
