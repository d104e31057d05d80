// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <stdexcept>

#include "contact_flow/nearest_name.h"
#include "robot_fields.h"
#include "robot_parts.h"

namespace contact_flow {
namespace {

/// A joint that follows another, from YAML or from <mimic>; a master that is fixed is at zero.
void AddFollower(const std::string& name, const std::string& joint, const std::string& master,
                 double multiplier, double offset, RobotDescription* robot) {
  const RobotModel& model = robot->model;
  const RobotModel::Coordinate own = model.FindCoordinate(joint);
  const auto& names = model.coordinates;
  const bool fixed = std::find(names.begin(), names.end(), master) == names.end();
  robot->closures.push_back(MakeFollower(own, fixed ? own : model.FindCoordinate(master),
                                         fixed ? 0 : multiplier, offset));
  robot->closures.back()->parts.name = name;
}

}  // namespace

void AddMimics(RobotDescription* robot) {
  const std::vector<std::string>& held = robot->model.held;
  for (const RobotModel::Mimic& mimic : robot->model.mimics) {
    if (std::find(held.begin(), held.end(), mimic.joint) != held.end()) continue;
    AddFollower(mimic.joint + "_mimic", mimic.joint, mimic.master, mimic.multiplier, mimic.offset,
                robot);
  }
}

namespace {

/// Reads a closure of two joints.
void ReadFollower(const std::string& name, MapReader* reader, RobotDescription* robot) {
  std::string joint, other;
  double multiplier = 1, offset = 0;
  reader->Read("joint", &joint);
  reader->Require("other_joint");
  reader->Read("other_joint", &other);
  reader->Read("multiplier", &multiplier);
  reader->Read("offset", &offset);
  for (const char* key : {"joint", "other_joint"}) {
    try {
      robot->model.FindCoordinate(key == std::string("joint") ? joint : other);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("closures/" + name + "/" + key + ": " + error.what() +
                                  reader->Line(key));
    }
  }
  AddFollower(name, joint, other, multiplier, offset, robot);
  robot->closures.back()->parts.where = reader->Line("");
}

}  // namespace

void ReadClosures(const YAML::Node& map, RobotDescription* robot) {
  ForEach(map, "closures", [&](const std::string& name, MapReader* reader) {
    if (reader->Has("joint")) return ReadFollower(name, reader, robot);
    ElementParts parts;
    parts.name = name;
    YamlFields fields(robot->model, reader, &robot->inputs, &parts);
    fields.Point("link", "point");
    fields.Point("other_link", "other_point");
    std::string axes = "xyz";
    reader->Read("axes", &axes);
    bool taken[3] = {};
    for (const char letter : axes) {
      const int axis = letter - 'x';
      if (axis < 0 || axis > 2 || taken[axis]) {
        throw std::invalid_argument("closures/" + name + "/axes is " + QuoteName(axes) +
                                    ", expected some of xyz, each once" + reader->Line("axes"));
      }
      taken[axis] = true;
      robot->closures.push_back(MakeClosureRow(parts.points[0], parts.points[1], axis));
      robot->closures.back()->parts.name = name + "_" + letter;
      robot->closures.back()->parts.where = reader->Line("");
    }
    if (axes.empty()) throw std::invalid_argument("closures/" + name + "/axes is empty");
  });
}

void Follow(const YAML::Node& positions, const YAML::Node& velocities, const RobotModel& model,
            Vector* q, Vector* v) {
  const auto given = [](const YAML::Node& map, const std::string& name) {
    return map.IsMap() && map[name].IsDefined();
  };
  for (std::size_t pass = 0; pass < model.mimics.size(); ++pass) {  // one may follow another
    for (const RobotModel::Mimic& mimic : model.mimics) {
      const auto& names = model.coordinates;
      if (std::find(names.begin(), names.end(), mimic.joint) == names.end()) continue;
      const RobotModel::Coordinate joint = model.FindCoordinate(mimic.joint);
      const bool moves = std::find(names.begin(), names.end(), mimic.master) != names.end();
      const RobotModel::Coordinate master = moves ? model.FindCoordinate(mimic.master) : joint;
      const double ratio = moves ? mimic.multiplier : 0;
      if (!given(positions, mimic.joint)) (*q)(joint.q) = ratio * (*q)(master.q) + mimic.offset;
      if (!given(velocities, mimic.joint)) (*v)(joint.v) = ratio * (*v)(master.v);
    }
  }
}

}  // namespace contact_flow
