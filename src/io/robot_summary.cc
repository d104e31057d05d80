// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/robot_summary.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "robot_parts.h"

namespace contact_flow {
namespace {

const char* KindName(JointKind kind) {
  switch (kind) {
    case JointKind::kRevolute:
      return "revolute";
    case JointKind::kPrismatic:
      return "prismatic";
    case JointKind::kTranslation:
      return "free translation";
    default:
      return "ball";
  }
}

/// Each line of a text as a comment.
std::string Commented(const std::string& text) {
  std::istringstream lines(text);
  std::string commented;
  for (std::string line; std::getline(lines, line);) commented += "#   " + line + "\n";
  return commented;
}

void DescribeJoints(const RobotModel& model, std::ostream* out) {
  *out << "#\n# joints: name, kind, limits, largest effort and speed, damping and friction of the "
          "URDF\n";
  for (const RigidBodyTree::Body& body : model.tree.bodies()) {
    const std::string& name = model.coordinates[body.q];
    *out << "#   " << name << ": " << KindName(body.joint);
    for (const RobotModel::JointTraits& joint : model.traits) {
      if (joint.name != name) continue;
      if (joint.limited) *out << ", " << joint.lower << " to " << joint.upper;
      if (joint.effort > 0) *out << ", effort " << joint.effort;
      if (joint.speed > 0) *out << ", speed " << joint.speed;
      if (joint.damping != 0) *out << ", damping " << joint.damping;
      if (joint.friction != 0) *out << ", friction " << joint.friction;
    }
    *out << "\n";
  }
  for (const RobotModel::Mimic& mimic : model.mimics) {
    *out << "#   " << mimic.joint << " = " << mimic.multiplier << " " << mimic.master << " + "
         << mimic.offset << "\n";
  }
}

/// Numbers of a map of the nominal run that are not usual.
YAML::Node NominalNode(const RobotDescription& robot) {
  const Vector usual = robot.model.tree.Neutral();
  YAML::Node map(YAML::NodeType::Map);
  for (int k = 0; k < usual.size(); ++k) {
    if (robot.nominal.x(k) == usual(k)) continue;
    std::ostringstream number;
    number.precision(9);
    number << robot.nominal.x(k);
    map[robot.model.coordinates[k]] = number.str();
  }
  return map;
}

}  // namespace

std::string DescribeRobot(const RobotDescription& robot, const YAML::Node& document,
                          const std::string& urdf_path, const std::string& folder) {
  const RobotModel& model = robot.model;
  double mass = 0;
  for (const RigidBodyTree::Body& body : model.tree.bodies()) mass += body.inertia.mass;
  std::ostringstream out;
  out.precision(6);
  out << "# " << model.name << ": " << model.links.size() << " links, " << model.tree.dof()
      << " degrees of freedom, " << mass << " kg that move, " << robot.constraints.size()
      << " contacts and limits, " << robot.closures.size() << " bilateral constraints\n";
  for (const std::string& warning : model.warnings) out << "#\n" << Commented(warning);
  DescribeJoints(model, &out);
  YAML::Node answer(YAML::NodeType::Map);
  if (!urdf_path.empty()) answer["urdf"] = urdf_path;
  for (const auto& entry : document) {
    const std::string key = entry.first.Scalar();
    if (key == "urdf" || key == "contacts" || key == "terrain" || key == "contacts_made" ||
        key == "constraints") {  // written below
      continue;
    }
    answer[key] = YAML::Clone(entry.second);  // `nominal` is written to
  }
  std::vector<std::string> limited;
  for (const RobotModel::JointTraits& joint : model.traits) {
    for (const auto& element : robot.constraints) {
      if (element->parts.name == joint.name + "_lower") limited.push_back(joint.name);
    }
  }
  const MadeContacts made = PlanContacts(document, folder, model, limited);
  YAML::Node constraints(YAML::NodeType::Map);
  for (const YAML::Node& map : {YAML::Node(document["constraints"]), made.constraints}) {
    if (!map.IsDefined() || !map.IsMap()) continue;
    for (const auto& entry : map) constraints[entry.first.Scalar()] = entry.second;
  }
  answer["constraints"] = constraints;
  YAML::Node nominal(YAML::NodeType::Map);
  if (document["nominal"].IsDefined() && document["nominal"].IsMap()) {
    nominal = YAML::Clone(document["nominal"]);
  }
  const YAML::Node positions = NominalNode(robot);
  if (positions.size() > 0) nominal["positions"] = positions;
  if (nominal.size() > 0) answer["nominal"] = nominal;
  YAML::Emitter emitter;
  emitter << answer;
  out << "\n" << emitter.c_str() << "\n";
  return out.str();
}

}  // namespace contact_flow
