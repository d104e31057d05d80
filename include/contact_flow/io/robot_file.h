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
///   urdf: quadruped.urdf      # path, relative to the YAML; not needed where the URDF is given
///   base: floating            # fixed (default), planar (in the x–z plane) or floating
///   gravity: 9.81             # [m/s²] downward
///   urdf_faults: lenient      # or strict, see ParseUrdf
///   joints: {limits: all}     # limits, damping, armature: what of the URDF's joints is used
///   soles:                    # a point of mass on springs below a link, called foot_sole
///     foot: {stiffness: 6000, damping: 15, mass: 0.05}
///   contacts: {ground: feet}  # from collision geometry, with `terrain`, see io/contacts.h
///   constraints:              # a ≥ 0, each: kind, its fields, restitution (default 0)
///     left_foot: {kind: plane, link: left_foot, point: [0, 0, 0]}
///   closures:                 # loops: two points that coincide, along axes of a frame
///     bar: {link: crank, point: [0, 0, 1], other_link: rod, axes: xz, frame: world}
///     gear: {joint: a, other_joint: b, multiplier: 2, offset: 0}  # q_a = 2 q_b; a mimic
///   inputs: [hip, knee]       # names and order of u; without it, those that efforts name
///   efforts:                  # each: kind and its fields
///     knee: {kind: joint_spring, joint: knee, stiffness: 20, damping: 1}
///   gravity_compensation: {joints: all, share: 1}
///   feedback:                 # u = u0 − K (x − x_ref), which efforts see as their inputs
///     gains: {knee: {positions: {knee: 40}, velocities: {knee: 2}}}
///   parameters:               # what can be set and differentiated by: a number, or equal ones
///     stiffness: [left_knee/stiffness, right_knee/stiffness]
///   nominal:                  # the run of a user who asks for nothing in particular
///     positions: {base_z: 0.6}
///     velocities: {}
///     inputs: {}
///     duration: 1             # [s]
///
/// Without `constraints` and `contacts`, a robot that can fall gets contacts with the ground z = 0
/// from all its collision geometry, or from its feet where that is more than 64; and where
/// `nominal` does not say base_z, contacts that were made begin at 0.1 m.
///
/// The kinds and their fields: model/rigid_body/constraint/ and effort/; the names of numbers:
/// ListNumbers. Everything that is wrong throws std::invalid_argument with its line or name, and
/// the nearest valid name.
RobotDescription ParseRobot(const std::string& urdf, const YAML::Node& document,
                            const std::string& folder = "");

/// The two texts that a robot is made of; both empty where there is none.
struct RobotTexts {
  std::string urdf;         ///< text of the URDF
  std::string yaml;         ///< text of the YAML
  std::string path;         ///< of the YAML, for messages; may be empty
  std::string folder = "";  ///< of the URDF, where meshes are sought

  /// Whether there is no robot.
  bool empty() const { return yaml.empty() && urdf.empty(); }
};

/// Longest YAML that is read [bytes].
constexpr std::size_t kMaxRobotYamlBytes = 1u << 20;

/// Reads the YAML of `path` and the URDF that goes with it: `urdf` if that is not empty, either the
/// text itself or the path of a file (which xacro is run on where it is xacro); else the file that
/// the YAML names under the key urdf; else the text `usual`.
RobotTexts ReadRobotTexts(const std::string& path, const std::string& urdf = "",
                          const std::string& usual = "");
/// A URDF or xacro of its own, without YAML.
RobotTexts ReadUrdf(const std::string& path);
/// Writes contacts that come from other files, meshes and terrains, into the YAML, so that the two
/// texts are all there is to a robot. ReadRobotTexts has done so.
void KeepMeshContacts(RobotTexts* texts);
/// These make the robot; messages begin with its path.
RobotDescription ParseRobot(const RobotTexts& texts);
/// The robot of these texts.
std::unique_ptr<RobotSystem> MakeRobot(const RobotTexts& texts,
                                       const ParameterValues& parameters = {});
/// Both, from the path of the YAML.
std::unique_ptr<RobotSystem> LoadRobot(const std::string& path,
                                       const ParameterValues& parameters = {});

}  // namespace contact_flow
