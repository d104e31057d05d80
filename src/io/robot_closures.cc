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

/// Reads the two points of a loop, and three tips along the axes of the link of the second, which
/// is the one of that frame. False where the frame is the world's, which has none.
bool ReadLoopPoints(const std::string& name, const std::string& frame, MapReader* reader,
                    YamlFields* fields) {
  std::string link, other_link;
  for (const char* key : {"link", "other_link"}) reader->Require(key);
  reader->Read("link", &link);
  reader->Read("other_link", &other_link);
  const bool in_link = frame != "world";
  if (in_link && frame != link && frame != other_link) {
    throw std::invalid_argument("closures/" + name + "/frame is " + QuoteName(frame) +
                                ", expected world, or one of its links: " + QuoteName(link) + ", " +
                                QuoteName(other_link) + reader->Line("frame"));
  }
  if (in_link && frame == link) {
    fields->Point("other_link", "other_point");
    fields->Point("link", "point");
  } else {
    fields->Point("link", "point");
    fields->Point("other_link", "other_point");
  }
  for (int axis = 0; in_link && axis < 3; ++axis) fields->Tip(Vec3<double>::Unit(axis));
  return in_link;
}

}  // namespace

void ReadClosures(const YAML::Node& map, RobotDescription* robot) {
  ForEach(map, "closures", [&](const std::string& name, MapReader* reader) {
    if (reader->Has("joint")) return ReadFollower(name, reader, robot);
    ElementParts parts;
    parts.name = name;
    YamlFields fields(robot->model, reader, &robot->inputs, &parts);
    std::string axes = "xyz", frame = "world";
    reader->Read("axes", &axes);
    reader->Read("frame", &frame);
    const bool in_link = ReadLoopPoints(name, frame, reader, &fields);
    bool taken[3] = {};
    for (const char letter : axes) {
      const int axis = letter - 'x';
      if (axis < 0 || axis > 2 || taken[axis]) {
        throw std::invalid_argument("closures/" + name + "/axes is " + QuoteName(axes) +
                                    ", expected some of xyz, each once" + reader->Line("axes"));
      }
      taken[axis] = true;
      const AttachedPoint &point = parts.points[0], &other = parts.points[1];
      robot->closures.push_back(in_link ? MakeClosureRow(point, other, parts.points[2 + axis])
                                        : MakeClosureRow(point, other, axis));
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
