// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "contact_flow/constraint_set.h"
#include "contact_meshes.h"
#include "contact_points.h"

namespace contact_flow {

/// Contacts from collision geometry, as a robot's YAML asks for them:
///
///   contacts:
///     ground: feet            # feet, all, none, or a list of links
///     height: 0               # of the ground without a terrain [m]
///     restitution: 0
///     friction: 0.8           # or no_slip; without it, none, but where the terrain says so
///     vertices: 16            # most points of one body, where its shapes have more
///     tolerance: 0.001        # fewer, where these leave less [m]
///   terrain: hall.yaml        # beside the URDF, or the map itself; without it z = height
///
/// A terrain is what a point has to be above, all of it: names to surfaces, as
///   floor: {kind: plane}
///   ramp: {kind: plane, normal: [-0.2, 0, 1], offset: -0.1}
///   wall: {kind: plane, normal: [-1, 0, 0], offset: -3}
///   dunes: {kind: height_field, amplitude: 0.05, wave_x: 3}
///   steps: {kind: stairs, rise: 0.1, run: 0.3, riser: 0.02, first: 1, last: 3}
///   field: {kind: height_map, origin: [-1, -1], step: [0.5, 0.5], heights: [[0, 0.1], [0, 0.2]]}
///   hall: {kind: height_map, image: hall.pgm, step: [0.02, 0.02], low: 0, high: 0.5}
///   crate: {kind: box, center: [2, 0, 0.1], length: 0.4, width: 0.3, height: 0.2, riser: 0.02}
///   belt: {kind: plane, motion: {direction: [1, 0, 0], velocity: 0.5}}       # see ReadMotion
/// so that its corners are hollow. Sharp edges that stick out have no derivative of the distance:
/// meshes are refused, sides of boxes lean. All but planes are for points. Rows of heights go along
/// x, the first one at the smallest y; of images the last.
///
/// `feet` are the ends of chains that reach lowest in the nominal state: bodies that carry no other
/// collision geometry, within a tenth of the robot's height of the lowest of them; and of these
/// what is as low.
struct ContactOptions {
  bool feet = false, all = false;
  std::vector<std::string> links;
  double height = 0;
  double restitution = 0;
  YAML::Node friction;  ///< of the contacts, unless their surface says it; null: none
  long vertices = 16;
  double tolerance = 1e-3;
  std::string line;                           ///< of the key, for messages
  YAML::Node terrain;                         ///< names to surfaces; null: the plane z = height
  int most = ConstraintSet::kMaxConstraints;  ///< contacts, and a third of it with friction
};

/// The terrain of the key `terrain`, a map or the path of one, from `folder`. Throws
/// std::invalid_argument for surfaces that are none.
YAML::Node ReadTerrain(const YAML::Node& value, const std::string& folder);

/// Reads the map of the key `contacts`. Throws std::invalid_argument with line and value.
ContactOptions ReadContactOptions(const YAML::Node& map, const RobotModel& model);

struct MadeContacts {
  YAML::Node constraints;  ///< as under the key `constraints`, for a person to edit
  int count = 0;
  double lowest = 0;                  ///< height of the lowest point above the ground [m]
  std::vector<std::string> warnings;  ///< what stands for what, and what was left out
};

/// Contacts of a robot with the ground; `q` is where feet are looked for. A mesh that is missing is
/// a warning, and an error where its link is asked for by name. More than `most` are an error.
MadeContacts MakeContacts(const RobotModel& model, const Vector& q, const ContactOptions& options,
                          ContactMeshes* meshes);

}  // namespace contact_flow
