// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/rigid_body/robot_description.h"

#include <map>
#include <stdexcept>
#include <string>
#include <tuple>

#include "moving_constraint.h"

namespace contact_flow {
namespace {

using Owner = NumberPlace::Owner;

struct LinkNumber {
  const char* name;
  const char* unit;
  const char* meaning;
  Range range;
};
constexpr LinkNumber kLinkNumbers[] = {
    {"mass", "kg", "mass of the link", Range::kPositive},
    {"x", "m", "centre of mass in the link's frame", Range::kAny},
    {"y", "m", "centre of mass in the link's frame", Range::kAny},
    {"z", "m", "centre of mass in the link's frame", Range::kAny},
    {"ixx", "kg m^2", "inertia about the centre of mass", Range::kNonNegative},
    {"ixy", "kg m^2", "inertia about the centre of mass", Range::kAny},
    {"ixz", "kg m^2", "inertia about the centre of mass", Range::kAny},
    {"iyy", "kg m^2", "inertia about the centre of mass", Range::kNonNegative},
    {"iyz", "kg m^2", "inertia about the centre of mass", Range::kAny},
    {"izz", "kg m^2", "inertia about the centre of mass", Range::kNonNegative},
};
/// Row and column of ixx, ixy, …
constexpr int kRow[] = {0, 0, 0, 1, 1, 2};
constexpr int kColumn[] = {0, 1, 2, 1, 2, 2};

template <class Elements>
void ListElements(const Elements& elements, Owner owner, std::vector<ExposedNumber>* all) {
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const ElementParts& parts = elements[i]->parts;
    for (std::size_t k = 0; k < parts.numbers.size(); ++k) {
      Parameter parameter = parts.numbers[k];
      parameter.name = parts.name + "/" + parameter.name;
      all->push_back(
          {parameter, parts.ranges[k], {{owner, static_cast<int>(i), static_cast<int>(k)}}});
    }
  }
}

}  // namespace

std::vector<ExposedNumber> ListNumbers(const RobotDescription& robot) {
  std::vector<ExposedNumber> all;
  all.push_back({{"gravity", "m/s^2", "downward acceleration", robot.gravity},
                 Range::kAny,
                 {{Owner::kGravity}}});
  for (std::size_t i = 0; i < robot.model.links.size(); ++i) {
    const RobotModel::Link& link = robot.model.links[i];
    if (link.inertia.mass == 0) continue;
    for (int k = 0; k < 10; ++k) {
      const NumberPlace place{Owner::kLink, static_cast<int>(i), k};
      const LinkNumber& number = kLinkNumbers[k];
      all.push_back({{"links/" + link.name + "/" + number.name, number.unit, number.meaning,
                      GetNumber(robot, place)},
                     number.range,
                     {place}});
    }
  }
  ListElements(robot.efforts, Owner::kEffort, &all);
  ListElements(robot.constraints, Owner::kConstraint, &all);
  for (std::size_t i = 0; i < robot.constraints.size(); ++i) {
    Parameter parameter = robot.constraints[i]->restitution;
    parameter.name = robot.constraints[i]->parts.name + "/" + parameter.name;
    all.push_back(
        {parameter, Range::kUnitInterval, {{Owner::kRestitution, static_cast<int>(i), 0}}});
  }
  for (std::size_t i = 0; i < robot.constraints.size(); ++i) {
    if (robot.constraints[i]->slip.rows == 0 || robot.constraints[i]->no_slip) continue;
    Parameter parameter = robot.constraints[i]->friction;
    parameter.name = robot.constraints[i]->parts.name + "/" + parameter.name;
    all.push_back({parameter, Range::kNonNegative, {{Owner::kFriction, static_cast<int>(i), 0}}});
  }
  return all;
}

double GetNumber(const RobotDescription& robot, const NumberPlace& place) {
  switch (place.owner) {
    case Owner::kEffort:
      return robot.efforts[place.index]->parts.numbers[place.number].value;
    case Owner::kConstraint:
      return robot.constraints[place.index]->parts.numbers[place.number].value;
    case Owner::kRestitution:
      return robot.constraints[place.index]->restitution.value;
    case Owner::kFriction:
      return robot.constraints[place.index]->friction.value;
    case Owner::kGravity:
      return robot.gravity;
    case Owner::kLink:
      break;
  }
  const BodyInertia& inertia = robot.model.links[place.index].inertia;
  if (place.number == 0) return inertia.mass;
  if (place.number < 4) return inertia.com(place.number - 1);
  return inertia.central(kRow[place.number - 4], kColumn[place.number - 4]);
}

void SetNumber(const NumberPlace& place, double value, RobotDescription* robot) {
  switch (place.owner) {
    case Owner::kEffort:
      robot->efforts[place.index]->parts.numbers[place.number].value = value;
      return;
    case Owner::kConstraint: {
      ConstraintElement* element = robot->constraints[place.index].get();
      element->parts.numbers[place.number].value = value;
      if (auto* moving = dynamic_cast<MovingConstraint*>(element)) moving->TakeNumbers();
      return;
    }
    case Owner::kRestitution:
      robot->constraints[place.index]->restitution.value = value;
      return;
    case Owner::kFriction:
      robot->constraints[place.index]->friction.value = value;
      return;
    case Owner::kGravity:
      robot->gravity = value;
      return;
    case Owner::kLink:
      break;
  }
  BodyInertia& inertia = robot->model.links[place.index].inertia;
  if (place.number == 0) {
    inertia.mass = value;
  } else if (place.number < 4) {
    inertia.com(place.number - 1) = value;
  } else {
    const int row = kRow[place.number - 4], column = kColumn[place.number - 4];
    inertia.central(row, column) = inertia.central(column, row) = value;
  }
}

void CheckPlaces(const std::vector<ExposedNumber>& parameters) {
  std::map<std::tuple<Owner, int, int>, std::string> owners;
  for (const ExposedNumber& number : parameters) {
    const std::string& name = number.parameter.name;
    for (const NumberPlace& place : number.places) {
      const auto key = std::make_tuple(place.owner, place.index, place.number);
      const auto [owner, first] = owners.emplace(key, name);
      if (first) continue;
      throw std::invalid_argument("parameter '" + name + "' has a number that parameter '" +
                                  owner->second + "' has already: a number has one parameter");
    }
  }
}

}  // namespace contact_flow
