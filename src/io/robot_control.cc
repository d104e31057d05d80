// SPDX-License-Identifier: BSD-3-Clause
// Efforts of a robot, what they follow, and what closes its loop.
#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "contact_flow/nearest_name.h"
#include "robot_fields.h"
#include "robot_parts.h"

namespace contact_flow {
namespace {

/// Whether this is how angles, or a quaternion, are called.
bool IsOfRotation(const std::string& ending) {
  for (const char* name : {"roll", "pitch", "yaw", "qw", "qx", "qy", "qz", "wx", "wy", "wz", "r",
                           "p", "rx", "ry", "rz"}) {
    if (ending == name) return true;
  }
  return false;
}

/// Throws where what says how an effort falls with speed is given in part.
void CheckSpeedLimit(const ElementParts& effort, const MapReader& reader) {
  const auto given = [&](const char* key) {
    return std::any_of(effort.numbers.begin(), effort.numbers.end(), [&](const Parameter& number) {
      return number.name == key && number.value < ElementFields::kUnlimited;
    });
  };
  const auto refuse = [&](const char* key, const char* why) {
    throw std::invalid_argument("efforts/" + effort.name + "/" + key + " " + why +
                                reader.Line(key));
  };
  if (given("speed") && !given("stall") && !given("limit")) {
    refuse("speed", "needs the effort at standstill, too: add `stall` or `limit`");
  }
  if (given("stall") && !given("speed")) {
    refuse("stall", "bounds an effort that falls with speed: add `speed`, or say `limit`");
  }
}

}  // namespace

std::string ReadKind(MapReader* reader, const std::vector<std::string>& kinds) {
  reader->Require("kind");
  int kind = 0;
  reader->Read("kind", kinds, &kind);
  return kinds[kind];
}

void ReadNamed(const YAML::Node& map, const std::string& name,
               const std::vector<std::string>& names, double* values) {
  MapReader reader(map, name);
  for (const std::string& key : reader.Keys()) {
    const std::size_t end = key.rfind('_');
    const auto known = [&](const std::string& part) {
      const std::string other = key.substr(0, end) + part;
      return std::find(names.begin(), names.end(), other) != names.end() ? other : "";
    };
    if (end == std::string::npos || !known(key.substr(end)).empty()) continue;
    std::string parts;
    for (const char* part : {"_qw", "_qx", "_qy", "_qz", "_wx", "_wy", "_wz"}) {
      if (!known(part).empty()) parts += (parts.empty() ? "" : ", ") + known(part);
    }
    if (parts.empty() || !IsOfRotation(key.substr(end + 1))) continue;
    throw std::invalid_argument(name + ": unknown key '" + key + "'; the orientation is " + parts +
                                reader.Line(key));
  }
  for (std::size_t k = 0; k < names.size(); ++k) reader.Read(names[k], &values[k]);
  reader.Finish();
}

void NormalizeQuaternions(const RobotModel& model, const std::string& name, const std::string& line,
                          Vector* q) {
  for (const RigidBodyTree::Body& body : model.tree.bodies()) {
    if (body.joint != JointKind::kBall) continue;
    const double length = q->segment<4>(body.q).norm();
    if (!(std::abs(length - 1) < 1e-3)) {
      throw std::invalid_argument(name + ": the quaternion from " + model.coordinates[body.q] +
                                  " has length " + std::to_string(length) + ", expected 1" + line);
    }
    q->segment<4>(body.q) /= length;
  }
}

void ReadInputs(MapReader* reader, std::vector<std::string>* inputs) {
  reader->Read("inputs", inputs);
  for (auto it = inputs->begin(); it != inputs->end(); ++it) {
    if (std::find(inputs->begin(), it, *it) == it) continue;
    throw std::invalid_argument("inputs names '" + *it + "' twice" + reader->Line("inputs"));
  }
}

bool FollowsTime(const YAML::Node& efforts) {
  if (!efforts.IsDefined() || !efforts.IsMap()) return false;
  for (const auto& effort : efforts) {
    if (effort.second.IsMap() && effort.second["reference"]) return true;
  }
  return false;
}

void ReadEfforts(const YAML::Node& map, RobotDescription* robot) {
  ForEach(map, "efforts", [&](const std::string& name, MapReader* reader) {
    for (const auto& other : robot->efforts) {
      if (other->parts.name != name) continue;
      throw std::invalid_argument("efforts/" + name +
                                  " is made by `soles` or `joints`, too: rename it" +
                                  other->parts.where);
    }
    const std::string kind = ReadKind(reader, EffortKinds());
    std::unique_ptr<EffortElement> element = MakeEffort(kind);
    element->parts.name = name;
    element->parts.where = reader->Line("");
    YamlFields fields(robot->model, reader, &robot->inputs, &element->parts);
    ReadEffort(kind, &fields);
    CheckSpeedLimit(element->parts, *reader);
    if (kind == "actuator") CheckGear(element->parts, *reader);
    robot->efforts.push_back(std::move(element));
  });
}

/// Beside friction what switches is not offered.
void RefuseFriction(const RobotDescription& robot) {
  const auto& constraints = robot.constraints;
  const auto rubs = std::find_if(constraints.begin(), constraints.end(),
                                 [](const auto& element) { return element->slip.rows > 0; });
  if (rubs == constraints.end()) return;
  for (const auto& effort : robot.efforts) {
    if (!effort->parts.reference || effort->parts.reference->Switches().empty()) continue;
    throw std::invalid_argument(
        "efforts/" + effort->parts.name +
        "/reference is linear: its rate jumps, which is not offered beside friction ('" +
        (*rubs)->parts.name +
        "' has it). Take kind: blended, whose corners last for `blend` [s], or cubic" +
        effort->parts.where);
  }
}

void AddSwitches(RobotDescription* robot) {
  std::map<double, int> instants;  // to the constraint
  for (const auto& effort : robot->efforts) {
    if (!effort->parts.reference) continue;
    for (double t : effort->parts.reference->Switches()) instants[t] = 0;
  }
  if (instants.empty()) return;
  RefuseFriction(*robot);
  const std::size_t most = ConstraintSet::kMaxConstraints;
  if (robot->constraints.size() + instants.size() > most) {
    throw std::invalid_argument("efforts: linear references switch at " +
                                std::to_string(instants.size()) + " instants, which with " +
                                std::to_string(robot->constraints.size()) +
                                " constraints are more than " + std::to_string(most) +
                                ": take kind: cubic or blended, which have no switches");
  }
  int count = 0;
  for (auto& [t, index] : instants) {
    std::unique_ptr<ConstraintElement> knot = MakeConstraint("upper_limit");
    knot->parts.name = "knot_" + std::to_string(++count);
    for (const auto& other : robot->constraints) {
      if (other->parts.name != knot->parts.name) continue;
      throw std::invalid_argument("constraints/" + knot->parts.name +
                                  " is what a reference's instants are called: rename it");
    }
    knot->parts.joints = {robot->model.ClockCoordinate()};
    knot->parts.numbers = {{"upper", "s", "instant of a reference", t}};
    knot->parts.ranges = {Range::kAny};
    index = static_cast<int>(robot->constraints.size());
    robot->switches.push_back(index);
    robot->constraints.push_back(std::move(knot));
  }
  for (const auto& effort : robot->efforts) {
    if (!effort->parts.reference) continue;
    for (double t : effort->parts.reference->Switches()) {
      effort->parts.switches.push_back(instants.at(t));
    }
  }
}

void ReadWeightShare(const YAML::Node& map, RobotDescription* robot) {
  if (!map.IsDefined() || map.IsNull()) return;
  MapReader reader(map, "gravity_compensation");
  const RobotModel& model = robot->model;
  std::vector<std::string> joints = {"all"};
  double share = 1;
  reader.Read("joints", &joints);
  reader.Read("share", &share);
  reader.Finish();
  robot->weight_share = Vector::Zero(model.tree.dof());
  if (joints == std::vector<std::string>{"all"}) {
    joints.clear();
    for (const RobotModel::JointTraits& joint : model.traits) {
      const auto& names = model.coordinates;
      if (std::find(names.begin(), names.end(), joint.name) != names.end()) {
        joints.push_back(joint.name);
      }
    }
  }
  for (const std::string& joint : joints) {
    try {
      robot->weight_share(model.FindCoordinate(joint).v) = share;
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("gravity_compensation/joints: " + std::string(error.what()) +
                                  reader.Line("joints"));
    }
  }
}

void ReadFeedback(const YAML::Node& map, RobotDescription* robot) {
  if (!map.IsDefined() || map.IsNull()) return;
  const RobotModel& model = robot->model;
  const int nq = model.tree.num_positions(), nv = model.tree.dof();
  const auto m = static_cast<Eigen::Index>(robot->inputs.size());
  MapReader reader(map, "feedback");
  StateFeedback& feedback = robot->feedback;
  feedback.q = robot->nominal.x.head(nq);
  feedback.v = robot->nominal.x.tail(nv);
  MapReader reference(reader.Child("reference"), "feedback/reference");
  ReadNamed(reference.Child("positions"), "feedback/reference/positions", model.coordinates,
            feedback.q.data());
  ReadNamed(reference.Child("velocities"), "feedback/reference/velocities", model.velocities,
            feedback.v.data());
  reference.Finish();
  NormalizeQuaternions(model, "feedback/reference/positions", reader.Line("reference"),
                       &feedback.q);
  feedback.gain_q = feedback.gain_v = Matrix::Zero(m, nv);
  reader.Require("gains");
  const YAML::Node gains = reader.Child("gains");
  MapReader rows(gains, "feedback/gains");
  for (const std::string& input : rows.Keys()) {
    const auto it = std::find(robot->inputs.begin(), robot->inputs.end(), input);
    if (it == robot->inputs.end()) {
      throw std::invalid_argument("feedback/gains: " + UnknownName("input", input, robot->inputs) +
                                  rows.Line(input));
    }
    Vector row = Vector::Zero(2 * nv);
    if (rows.Child(input).IsSequence()) {
      rows.Read(input, row.data(), 2 * nv);
    } else {
      const std::string name = "feedback/gains/" + input;
      MapReader parts(rows.Child(input), name);
      ReadNamed(parts.Child("positions"), name + "/positions", model.velocities, row.data());
      ReadNamed(parts.Child("velocities"), name + "/velocities", model.velocities, row.data() + nv);
      parts.Finish();
    }
    feedback.gain_q.row(it - robot->inputs.begin()) = row.head(nv).transpose();
    feedback.gain_v.row(it - robot->inputs.begin()) = row.tail(nv).transpose();
  }
  reader.Finish();
}

}  // namespace contact_flow
