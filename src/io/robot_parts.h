// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

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

/// The bilateral constraints of the mimic joints, called J_mimic.
void AddMimics(RobotDescription* robot);

/// The map of the key `closures`: points that coincide, joints that follow one another.
void ReadClosures(const YAML::Node& map, RobotDescription* robot);

/// Puts mimic joints where the joints that they follow send them, but for those that the YAML says.
void Follow(const YAML::Node& positions, const YAML::Node& velocities, const RobotModel& model,
            Vector* q, Vector* v);

/// Contacts that the YAML asks for, and those of a robot that could fall and has neither
/// `constraints` nor `contacts`; nothing (count 0) otherwise. Meshes are sought from `folder`.
MadeContacts PlanContacts(const YAML::Node& document, const std::string& folder,
                          const RobotModel& model);

}  // namespace contact_flow
