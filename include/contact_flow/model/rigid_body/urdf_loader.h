// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/model/rigid_body/robot_model.h"

namespace contact_flow {

/// Limits of what is read, far above any robot: a larger text is refused before it is parsed.
constexpr std::size_t kMaxUrdfBytes = 4u << 20;
constexpr int kMaxUrdfLinks = 1000;
constexpr int kMaxUrdfDepth = 100;

/// A robot from the text of a URDF, read by urdfdom. Joints: revolute, continuous, prismatic, fixed
/// (its links become one body), planar and floating. Numbers come in the order of the tree,
/// children by the alphabet of their joints. Each is called as its joint; those of a planar joint J
/// are J_x, J_y, J_angle; of a floating one J_x, J_y, J_z, J_qw, J_qx, J_qy, J_qz.
///
/// Limits, damping and friction are not used, which `warnings` of the answer say; visual and
/// collision geometry neither. Inertials must be physical: mass > 0; rotational inertia about the
/// centre of mass positive definite, each principal moment at most the sum of the others, or all
/// zero for a point mass. A link without one is without mass. Everything else throws
/// std::invalid_argument with the name of the link or joint: text that is no URDF, mimic joints,
/// loops, loose parts, numbers that are not finite, and joints that move no mass.
RobotModel ParseUrdf(const std::string& text, RobotBase base);

/// Throws std::invalid_argument for a text that is too long, too deep, has too many links, or bytes
/// that are not of any XML: what a parser should not be trusted with.
void CheckUrdfText(const std::string& text);

}  // namespace contact_flow
