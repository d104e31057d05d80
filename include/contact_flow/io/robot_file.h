// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <memory>
#include <string>

#include "contact_flow/model/rigid_body/robot_system.h"

namespace contact_flow {

/// Robots from a URDF and the YAML beside it:
///
///   urdf: quadruped.urdf      # path, relative to the YAML; may be left out where the URDF is
///   given base: floating            # fixed (default), planar (in the x–z plane) or floating
///   gravity: 9.81             # [m/s²] downward
///   constraints:              # a ≥ 0, each: kind, its fields, restitution (default 0)
///     left_foot: {kind: plane, link: left_foot, point: [0, 0, 0]}
///   closures:                 # loops: two points that coincide, along some world axes (default
///   xyz)
///     bar: {link: crank, point: [0, 0, 1], other_link: rod, axes: xz}
///   inputs: [hip, knee]       # names and order of u; without it, those that efforts name as they
///   come efforts:                  # each: kind and its fields
///     knee: {kind: joint_spring, joint: knee, stiffness: 20, damping: 1}
///   parameters:               # what can be set and differentiated by; one number or several equal
///   ones
///     stiffness: [left_knee/stiffness, right_knee/stiffness]
///   nominal:                  # the run of a user who asks for nothing in particular
///     positions: {base_z: 0.6}
///     velocities: {}
///     inputs: {}
///     duration: 1             # [s]
///
/// The kinds and their fields: model/rigid_body/constraint/ and effort/; the names of numbers:
/// ListNumbers. Everything that is wrong throws std::invalid_argument with its line or name, and
/// the nearest valid name.
RobotDescription ParseRobot(const std::string& urdf, const YAML::Node& document);

/// The two texts that a robot is made of; both empty where there is none.
struct RobotTexts {
  std::string urdf;  ///< text of the URDF
  std::string yaml;  ///< text of the YAML
  std::string path;  ///< of the YAML, for messages; may be empty

  /// Whether there is no robot.
  bool empty() const { return yaml.empty() && urdf.empty(); }
};

/// Longest YAML that is read [bytes].
constexpr std::size_t kMaxRobotYamlBytes = 1u << 20;

/// Reads the YAML of `path` and the URDF that goes with it: `urdf` if that is not empty, either the
/// text itself or the path of a file; else the file that the YAML names under the key urdf; else
/// the text `usual`.
RobotTexts ReadRobotTexts(const std::string& path, const std::string& urdf = "",
                          const std::string& usual = "");
/// These make the robot; messages begin with its path.
RobotDescription ParseRobot(const RobotTexts& texts);
/// The robot of these texts.
std::unique_ptr<RobotSystem> MakeRobot(const RobotTexts& texts,
                                       const ParameterValues& parameters = {});
/// Both, from the path of the YAML.
std::unique_ptr<RobotSystem> LoadRobot(const std::string& path,
                                       const ParameterValues& parameters = {});

}  // namespace contact_flow
