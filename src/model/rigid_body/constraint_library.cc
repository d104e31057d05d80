// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <stdexcept>

#include "contact_flow/model/rigid_body/constraint/brake.h"
#include "contact_flow/model/rigid_body/constraint_element.h"
#include "contact_flow/nearest_name.h"
#include "src/model/rigid_body/constraint/box.h"
#include "src/model/rigid_body/constraint/coincidence.h"
#include "src/model/rigid_body/constraint/follower.h"
#include "src/model/rigid_body/constraint/height_field.h"
#include "src/model/rigid_body/constraint/height_map.h"
#include "src/model/rigid_body/constraint/joint_limit.h"
#include "src/model/rigid_body/constraint/link_plane.h"
#include "src/model/rigid_body/constraint/plane.h"
#include "src/model/rigid_body/constraint/rim.h"
#include "src/model/rigid_body/constraint/spheres.h"
#include "src/model/rigid_body/constraint/stairs.h"

namespace contact_flow {
namespace {

struct ConstraintKind {
  std::unique_ptr<ConstraintElement> (*make)();
  void (*read)(ElementFields*);
};

template <class K>
std::unique_ptr<ConstraintElement> MakeConstraintOf() {
  return std::make_unique<ConstraintOf<K>>();
}

template <class K>
std::pair<const std::string, ConstraintKind> ConstraintEntry() {
  return {K::kName, {&MakeConstraintOf<K>, &K::Read}};
}

const std::map<std::string, ConstraintKind>& Constraints() {
  static const std::map<std::string, ConstraintKind> registry = {
      ConstraintEntry<constraint::Box>(),        ConstraintEntry<constraint::HeightField>(),
      ConstraintEntry<constraint::HeightMap>(),  ConstraintEntry<constraint::LinkPlane>(),
      ConstraintEntry<constraint::LowerLimit>(), ConstraintEntry<constraint::Plane>(),
      ConstraintEntry<constraint::Rim>(),        ConstraintEntry<constraint::Spheres>(),
      ConstraintEntry<constraint::Stairs>(),     ConstraintEntry<constraint::UpperLimit>(),
  };
  return registry;
}

const ConstraintKind& FindConstraint(const std::string& kind) {
  const auto it = Constraints().find(kind);
  if (it == Constraints().end()) {
    throw std::invalid_argument(UnknownName("kind of constraint", kind, ConstraintKinds()));
  }
  return it->second;
}

}  // namespace

std::vector<std::string> ConstraintKinds() {
  std::vector<std::string> names;
  for (const auto& entry : Constraints()) names.push_back(entry.first);
  return names;
}

std::unique_ptr<ConstraintElement> MakeConstraint(const std::string& kind) {
  return FindConstraint(kind).make();
}

void ReadConstraint(const std::string& kind, ElementFields* fields) {
  FindConstraint(kind).read(fields);
}

std::unique_ptr<ConstraintElement> MakeClosureRow(const AttachedPoint& point,
                                                  const AttachedPoint& other, int axis) {
  std::unique_ptr<ConstraintElement> row = MakeConstraintOf<constraint::Coincidence>();
  row->parts.points = {point, other};
  for (int k = 0; k < 3; ++k) {
    row->parts.numbers.push_back(
        {"direction", "", "component of the direction", k == axis ? 1. : 0.});
    row->parts.ranges.push_back(Range::kAny);
  }
  return row;
}

std::unique_ptr<ConstraintElement> MakeClosureRow(const AttachedPoint& point,
                                                  const AttachedPoint& other,
                                                  const AttachedPoint& tip) {
  std::unique_ptr<ConstraintElement> row = MakeConstraintOf<constraint::LinkCoincidence>();
  row->parts.points = {point, other, tip};
  return row;
}

std::unique_ptr<ConstraintElement> MakeFollower(const RobotModel::Coordinate& joint,
                                                const RobotModel::Coordinate& master,
                                                double multiplier, double offset) {
  std::unique_ptr<ConstraintElement> row = MakeConstraintOf<constraint::Follower>();
  row->parts.joints = {joint, master};
  row->parts.numbers = {{"multiplier", "", "of the master's position", multiplier},
                        {"offset", "m or rad", "where the master is at zero", offset}};
  row->parts.ranges = {Range::kAny, Range::kAny};
  return row;
}

std::unique_ptr<ConstraintElement> MakeBrake(const RobotModel::Coordinate& joint,
                                             const RobotModel::Coordinate& pad) {
  std::unique_ptr<ConstraintElement> brake = MakeConstraintOf<constraint::Brake>();
  brake->parts.joints = {joint, pad};
  brake->friction.unit = "N or N m";
  brake->friction.meaning = "largest friction of the joint";
  return brake;
}

}  // namespace contact_flow
