// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <memory>
#include <string>

#include "contact_flow/model/rigid_body/robot_system.h"

namespace contact_flow {

/// Robots from a URDF and the YAML beside it:
///
///   urdf: quadruped.urdf      # path, relative to the YAML
///   base: floating            # fixed (default), planar (in the x–z plane) or floating
///   gravity: 9.81             # [m/s²] downward
///   constraints:              # a ≥ 0, each: kind, its fields, restitution (default 0)
///     left_foot: {kind: plane, link: left_foot, point: [0, 0, 0]}
///   closures:                 # loops: two points that coincide, along some world axes (default xyz)
///     bar: {link: crank, point: [0, 0, 1], other_link: rod, axes: xz}
///   inputs: [hip, knee]       # names and order of u; without it, those that efforts name as they come
///   efforts:                  # each: kind and its fields
///     knee: {kind: joint_spring, joint: knee, stiffness: 20, damping: 1}
///   parameters:               # what can be set and differentiated by; one number or several equal ones
///     stiffness: [left_knee/stiffness, right_knee/stiffness]
///   nominal:                  # the run of a user who asks for nothing in particular
///     positions: {base_z: 0.6}
///     velocities: {}
///     inputs: {}
///     duration: 1             # [s]
///
/// The kinds and their fields: model/rigid_body/constraint/ and effort/; the names of numbers: ListNumbers.
/// Everything that is wrong throws std::invalid_argument with its line or name, and the nearest valid
/// name.
RobotDescription ParseRobot(const std::string& urdf, const YAML::Node& document);

/// From the path of the YAML.
RobotDescription LoadRobotDescription(const std::string& path);
std::unique_ptr<RobotSystem> LoadRobot(const std::string& path,
                                       const ParameterValues& parameters = {});

}  // namespace contact_flow
