// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "contact_flow/nearest_name.h"
#include "robot_parts.h"
#include "src/model/rigid_body/contact_friction.h"

namespace contact_flow {
namespace {

using Traits = RobotModel::JointTraits;

bool Moves(const RobotModel& model, const std::string& joint) {
  const auto& names = model.coordinates;
  return std::find(names.begin(), names.end(), joint) != names.end();
}

/// Throws where the number that a key asks for is negative in the URDF.
void RefuseNegative(const MapReader& reader, const std::string& key, const Traits& joint,
                    double number) {
  if (!(number < 0)) return;
  std::ostringstream text;
  text << "joints/" << key << ": the URDF gives joint '" << joint.name << "' the " << key << " "
       << number << ", which would drive it: correct its <dynamics>, or name the others";
  throw std::invalid_argument(text.str() + reader.Line(key));
}

/// The joints that a key names: `all` that have what is asked for, or a list, which must have it.
template <class Has>
std::vector<Traits> Chosen(MapReader* reader, const std::string& key, const RobotModel& model,
                           const char* what, Has has) {
  std::vector<std::string> asked;
  reader->Read(key, &asked);
  const bool all = asked == std::vector<std::string>{"all"};
  std::vector<Traits> chosen;
  for (const Traits& joint : model.traits) {
    const bool named = std::find(asked.begin(), asked.end(), joint.name) != asked.end();
    if ((all && Moves(model, joint.name)) || named) {
      if (key == "damping") RefuseNegative(*reader, key, joint, joint.damping);
      if (key == "friction") RefuseNegative(*reader, key, joint, joint.friction);
    }
    if (all && Moves(model, joint.name) && has(joint)) chosen.push_back(joint);
  }
  if (all) return chosen;
  for (const std::string& name : asked) {
    const auto same = [&](const Traits& other) { return other.name == name; };
    if (std::any_of(chosen.begin(), chosen.end(), same)) {
      throw std::invalid_argument("joints/" + key + " names '" + name + "' twice" +
                                  reader->Line(key));
    }
    try {
      model.FindCoordinate(name);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("joints/" + key + ": " + error.what() + reader->Line(key));
    }
    const auto joint = std::find_if(model.traits.begin(), model.traits.end(), same);
    if (joint == model.traits.end() || !has(*joint)) {
      throw std::invalid_argument("joints/" + key + ": the URDF gives joint '" + name + "' no " +
                                  what + reader->Line(key));
    }
    chosen.push_back(*joint);
  }
  return chosen;
}

bool HasLimits(const Traits& joint) { return joint.limited && joint.lower < joint.upper; }

/// Tells of stops of hinges that are many turns apart.
void WarnOfDegrees(const Traits& joint, RobotModel* model) {
  constexpr double kManyTurns = 8 * M_PI;
  const double far = std::max(std::abs(joint.lower), std::abs(joint.upper));
  if (far < kManyTurns || model->units[model->FindCoordinate(joint.name).q] != "rad") return;
  std::ostringstream text;
  text << "joints/limits: the URDF's range of '" << joint.name << "', " << joint.lower << " to "
       << joint.upper << " rad, is of many turns: it may be in degrees";
  model->warnings.push_back(text.str());
}

bool HasDamping(const Traits& joint) { return joint.damping > 0; }
bool HasFriction(const Traits& joint) { return joint.friction > 0; }

std::string PadOf(const std::string& joint) { return joint + "_pad"; }

}  // namespace

void AddBrakePads(const YAML::Node& map, RobotModel* model) {
  MapReader reader(map, "joints");
  for (const Traits& joint : Chosen(&reader, "friction", *model, "friction", HasFriction)) {
    const RobotModel::Mount pad =
        model->AddPrismatic({-1, Pose()}, PadOf(joint.name), Vec3<double>::UnitX());  // weightless
    BodyInertia inertia;
    inertia.mass = 1;
    model->links.push_back({PadOf(joint.name), pad.body, pad.pose, inertia});
    model->JoinInertias();
  }
}

JointChoices ReadJoints(const YAML::Node& map, RobotDescription* robot) {
  MapReader reader(map, "joints");
  const RobotModel& model = robot->model;
  JointChoices choices;
  double restitution = 0;
  reader.Read("restitution", &restitution);
  for (const Traits& joint : Chosen(&reader, "limits", model, "range", HasLimits)) {
    for (const bool upper : {false, true}) {
      YAML::Node stop;
      stop["kind"] = upper ? "upper_limit" : "lower_limit";
      stop["joint"] = joint.name;
      stop[upper ? "upper" : "lower"] = upper ? joint.upper : joint.lower;
      if (restitution != 0) stop["restitution"] = restitution;
      stop.SetStyle(YAML::EmitterStyle::Flow);
      choices.constraints[joint.name + (upper ? "_upper" : "_lower")] = stop;
    }
    choices.limited.push_back(joint.name);
    WarnOfDegrees(joint, &robot->model);
  }
  std::string without;
  for (const Traits& joint : model.traits) {
    if (joint.limited && !HasLimits(joint)) without += " '" + joint.name + "'";
  }
  if (!without.empty() && reader.Has("limits")) {
    robot->model.warnings.push_back(
        "joints/limits: no stops for these joints, whose lower limit is not below the upper one:" +
        without);
  }
  for (const Traits& joint : Chosen(&reader, "damping", model, "damping", HasDamping)) {
    YAML::Node damper;
    damper["kind"] = "joint_spring";
    damper["joint"] = joint.name;
    damper["stiffness"] = 0;
    damper["damping"] = joint.damping;
    damper.SetStyle(YAML::EmitterStyle::Flow);
    choices.efforts[joint.name + "_damping"] = damper;
  }
  for (const Traits& joint : Chosen(&reader, "friction", model, "friction", HasFriction)) {
    std::unique_ptr<ConstraintElement> brake =
        MakeBrake(model.FindCoordinate(joint.name), model.FindCoordinate(PadOf(joint.name)));
    brake->parts.name = joint.name + "_friction";
    GiveFriction(model, joint.friction, brake.get());
    choices.brakes.push_back(std::move(brake));
    YAML::Node press;  // at zero, where the pad rests, the force is −1
    press["kind"] = "joint_spring";
    press["joint"] = PadOf(joint.name);
    press["stiffness"] = 1;
    press["rest"] = -1;
    press.SetStyle(YAML::EmitterStyle::Flow);
    choices.efforts[PadOf(joint.name)] = press;
  }
  MapReader armature(reader.Child("armature"), "joints/armature");
  for (const std::string& name : armature.Keys()) {
    double inertia = 0;
    armature.Read(name, &inertia);
    if (!(inertia >= 0)) {
      throw std::invalid_argument("joints/armature/" + name + " is negative" + armature.Line(name));
    }
    try {
      if (robot->armature.size() == 0) robot->armature = Vector::Zero(model.tree.dof());
      robot->armature(model.FindCoordinate(name).v) = inertia;
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("joints/armature: " + std::string(error.what()) +
                                  armature.Line(name));
    }
  }
  reader.Finish();
  return choices;
}

void CentreLimited(const std::vector<std::string>& limited, const RobotModel& model, Vector* q) {
  for (const Traits& joint : model.traits) {
    if (std::find(limited.begin(), limited.end(), joint.name) == limited.end()) continue;
    if (joint.lower < 0 && joint.upper > 0) continue;
    (*q)(model.FindCoordinate(joint.name).q) = 0.5 * (joint.lower + joint.upper);
  }
}

}  // namespace contact_flow
