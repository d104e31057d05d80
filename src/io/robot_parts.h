// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/io/contacts.h"
#include "contact_flow/io/map_reader.h"
#include "contact_flow/model/rigid_body/robot_description.h"

namespace contact_flow {

/// Calls read(name, reader) for each entry of a map of maps.
template <class Read>
void ForEach(const YAML::Node& map, const std::string& name, Read&& read) {
  MapReader outer(map, name);
  for (const std::string& key : outer.Keys()) {
    MapReader reader(outer.Child(key), name + "/" + key);
    read(key, &reader);
    reader.Finish();
  }
}

/// The value of a key `friction` of a map that is called `map`: a coefficient that is not negative,
/// or no_slip, which is infinite.
double ReadFriction(const std::string& map, MapReader* reader);

/// The bilateral constraints of the mimic joints, called J_mimic.
void AddMimics(RobotDescription* robot);

/// The map of the key `closures`: points that coincide, joints that follow one another.
void ReadClosures(const YAML::Node& map, RobotDescription* robot);

/// Puts mimic joints where the joints that they follow send them, but for those that the YAML says.
void Follow(const YAML::Node& positions, const YAML::Node& velocities, const RobotModel& model,
            Vector* q, Vector* v);

/// What the key `joints` asks for: stops, dampers and rotors of joints by the URDF.
struct JointChoices {
  YAML::Node constraints{YAML::NodeType::Map};
  YAML::Node efforts{YAML::NodeType::Map};
  std::vector<std::string> limited;  ///< joints with stops
};

///   joints:
///     limits: all             # or a list: stops at the limits of the URDF, J_lower and J_upper
///     restitution: 0          # of the stops
///     damping: [knee]         # or all: by the URDF, J_damping
///     armature: {knee: 0.01}  # inertia of the rotor times the gear ratio squared [kg m² or kg]
JointChoices ReadJoints(const YAML::Node& map, RobotDescription* robot);
/// Puts joints with stops that exclude zero into the middle of their range.
void CentreLimited(const std::vector<std::string>& limited, const RobotModel& model, Vector* q);

///   soles:
///     left_foot: {stiffness: 6000, damping: 15, mass: 0.05}
/// Each adds a link left_foot_sole, a point of that mass on springs along the axes of the link
/// (joints left_foot_sole_x, _y, _z), and hands it the link's collision geometry.
/// Returns the efforts.
YAML::Node AddSoles(const YAML::Node& map, RobotModel* model);

/// Contacts that the YAML asks for, and those of a robot that could fall and has neither
/// `constraints` nor `contacts`; nothing (count 0) otherwise. Meshes are sought from `folder`.
MadeContacts PlanContacts(const YAML::Node& document, const std::string& folder,
                          const RobotModel& model, const std::vector<std::string>& limited = {});

}  // namespace contact_flow
