// SPDX-License-Identifier: BSD-3-Clause
// Ground that moves by a function of time.
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "contact_flow/model/driven.h"
#include "robot_parts.h"
#include "src/model/rigid_body/moving_constraint.h"

namespace contact_flow {
namespace {

bool AnyMoves(const YAML::Node& map) {
  if (!map.IsDefined() || !map.IsMap()) return false;
  return std::any_of(map.begin(), map.end(), [](const auto& entry) {
    return entry.second.IsMap() && entry.second["motion"];
  });
}

/// Throws where a motion is none, or a part of one.
void CheckMotion(const std::string& name, const MapReader& motion) {
  const auto refuse = [&](const char* key, const char* why) {
    throw std::invalid_argument(name + "/" + key + " " + why + motion.Line(key));
  };
  const bool swings = motion.Has("amplitude");
  if (swings && !motion.Has("frequency")) refuse("amplitude", "needs a `frequency` [Hz]");
  for (const char* key : {"frequency", "phase"}) {
    if (motion.Has(key) && !swings) refuse(key, "is of a sinusoid: add its `amplitude` [m]");
  }
  const bool sampled = motion.Has("times") || motion.Has("values");
  if (motion.Has("periodic") && !sampled)
    refuse("periodic", "is of samples: add `times`, `values`");
  if (swings || sampled || motion.Has("velocity")) return;
  throw std::invalid_argument(
      name + " says no motion: add `velocity` [m/s], `amplitude` [m] with " +
      "`frequency` [Hz], or `times` [s] with `values` [m]" + motion.Line(""));
}

void ReadSamples(const std::string& name, MapReader* motion, SurfaceMotion* read) {
  std::vector<double> times, values;
  bool periodic = false;
  for (const char* key : {"times", "values"}) motion->Require(key);
  motion->Read("times", &times);
  motion->Read("values", &values);
  motion->Read("periodic", &periodic);
  try {
    read->Sample(times, values, periodic);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(name + ": " + error.what() + motion->Line("times"));
  }
}

/// Whether a constraint is of one point, and what is fixed to it, and the world.
bool IsOfGround(const ConstraintElement& element) {
  const std::vector<AttachedPoint>& points = element.parts.points;
  return element.Touches() && element.parts.joints.empty() &&
         std::all_of(points.begin() + 1, points.end(), [&](const AttachedPoint& point) {
           return point.body == points[0].body && point.link < 0;  // no place of its own
         });
}

}  // namespace

bool GroundMoves(const YAML::Node& document, const std::string& folder) {
  if (AnyMoves(document["constraints"])) return true;
  const YAML::Node made = document["contacts_made"];
  if (made.IsDefined() && made.IsMap()) return AnyMoves(made["constraints"]);
  return AnyMoves(ReadTerrain(document["terrain"], folder));
}

std::unique_ptr<ConstraintElement> ReadMotion(MapReader* reader, const RobotModel& model,
                                              std::unique_ptr<ConstraintElement> still) {
  const std::string name = still->parts.name + "/motion";
  if (!IsOfGround(*still)) {
    throw std::invalid_argument(name +
                                " is for ground, which is a plane, rim, box, "
                                "height_field, height_map or stairs: a link moves by its joints" +
                                reader->Line("motion"));
  }
  MapReader motion(reader->Child("motion"), name);
  CheckMotion(name, motion);
  motion.Require("direction");
  Vec3<double> direction = Vec3<double>::UnitZ();
  motion.Read("direction", direction.data(), 3);
  if (!(direction.norm() > 1e-6)) {
    throw std::invalid_argument(name + "/direction has no direction: give one, as [0, 0, 1]" +
                                motion.Line("direction"));
  }
  double number[SurfaceMotion::kNumbers] = {direction(0), direction(1), direction(2)};
  int next = 3;
  for (const char* key : {"velocity", "amplitude", "frequency", "phase"}) {
    motion.Read(key, &number[next++]);
  }
  SurfaceMotion read;
  if (motion.Has("times") || motion.Has("values")) ReadSamples(name, &motion, &read);
  motion.Finish();
  auto moving = std::make_unique<MovingConstraint>(std::move(still), read, model.ClockCoordinate());
  std::vector<Parameter>& numbers = moving->parts.numbers;
  const std::size_t own = numbers.size() - SurfaceMotion::kNumbers;
  for (std::size_t k = own; k < numbers.size(); ++k) numbers[k].value = number[k - own];
  moving->TakeNumbers();
  return moving;
}

void DriveClock(RobotDescription* robot) {
  const RobotModel& model = robot->model;
  if (robot->armature.size() == 0) robot->armature = Vector::Zero(model.tree.dof());
  robot->armature(model.ClockCoordinate().v) = kDrivenInertia;
}

}  // namespace contact_flow
