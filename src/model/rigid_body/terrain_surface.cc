// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/rigid_body/terrain_surface.h"

#include <cmath>
#include <memory>
#include <set>
#include <utility>

#include "moving_constraint.h"
#include "src/model/rigid_body/constraint/box.h"
#include "src/model/rigid_body/constraint/height_field.h"
#include "src/model/rigid_body/constraint/height_map.h"
#include "src/model/rigid_body/constraint/plane.h"
#include "src/model/rigid_body/constraint/stairs.h"

namespace contact_flow {
namespace {

using constraint::Box;
using constraint::HeightField;
using constraint::HeightMap;
using constraint::Plane;
using constraint::Stairs;

std::vector<double> Numbers(const ConstraintElement& element) {
  std::vector<double> numbers;
  for (const Parameter& number : element.parts.numbers) numbers.push_back(number.value);
  return numbers;
}

/// The surface of a constraint of this kind, near a point; empty for another kind.
TerrainSurface SurfaceOf(const ConstraintElement& element, const Vec3<double>& near, double sink) {
  const std::vector<double> numbers = Numbers(element);
  if (dynamic_cast<const ConstraintOf<Plane>*>(&element) != nullptr) {
    const Vec3<double> normal = Vec3<double>(numbers[0], numbers[1], numbers[2]).normalized();
    const Mat3<double> frame = AxisFrame(normal);
    const Vec3<double> foot = near + (numbers[3] - sink - normal.dot(near)) * normal;
    return [=](double s, double t) -> Vec3<double> {
      return foot + s * frame.col(0) + t * frame.col(1);
    };
  }
  if (dynamic_cast<const ConstraintOf<HeightField>*>(&element) != nullptr) {
    return [=](double s, double t) {
      double z[] = {near(0) + s, near(1) + t, 0};
      return Vec3<double>(z[0], z[1], -HeightField::Gap(numbers.data(), z) - sink);
    };
  }
  if (dynamic_cast<const ConstraintOf<Stairs>*>(&element) != nullptr) {
    return [=](double s, double t) {
      double z[] = {near(0) + s, near(1) + t, 0};
      return Vec3<double>(z[0], z[1], -Stairs::Gap(numbers.data(), z) - sink);
    };
  }
  if (dynamic_cast<const ConstraintOf<Box>*>(&element) != nullptr) {
    return [=](double s, double t) {
      double z[] = {near(0) + s, near(1) + t, 0};
      return Vec3<double>(z[0], z[1], -Box::Gap(numbers.data(), z) - sink);
    };
  }
  if (dynamic_cast<const ConstraintOf<HeightMap>*>(&element) != nullptr) {
    const std::shared_ptr<const HeightGrid> heights = element.parts.heights;
    return [=](double s, double t) {
      double z[] = {near(0) + s, near(1) + t, 0};
      return Vec3<double>(z[0], z[1], -HeightMap::Gap(*heights, numbers.data(), z) - sink);
    };
  }
  return {};
}

const MovingConstraint* AsMoving(const ConstraintElement& element) {
  return dynamic_cast<const MovingConstraint*>(&element);
}
/// A constraint as it is while its surface is not displaced.
const ConstraintElement& Still(const ConstraintElement& element) {
  const MovingConstraint* moving = AsMoving(element);
  return moving == nullptr ? element : moving->still();
}
bool IsPlane(const ConstraintElement& element) {
  return dynamic_cast<const ConstraintOf<Plane>*>(&element) != nullptr;
}

/// What makes two surfaces the same: their numbers without the radius of the sphere above a plane,
/// and where they move to.
std::vector<double> Identity(const ConstraintElement& element) {
  std::vector<double> numbers = Numbers(Still(element));
  if (IsPlane(Still(element))) numbers.pop_back();
  const MovingConstraint* moving = AsMoving(element);
  for (const double t : {0.0, 0.1, 0.7, 2.3}) {
    if (moving == nullptr) break;
    const Vec3<double> s = moving->motion().At(t)[0];
    numbers.insert(numbers.end(), s.data(), s.data() + 3);
  }
  return numbers;
}

}  // namespace

std::vector<TerrainPiece> TerrainNear(const RobotDescription& robot, const Vec3<double>& near,
                                      double sink) {
  std::vector<TerrainPiece> found;
  std::set<std::vector<double>> known;
  for (std::size_t i = 0; i < robot.constraints.size(); ++i) {
    const ConstraintElement& element = *robot.constraints[i];
    TerrainSurface surface = SurfaceOf(Still(element), near, sink);
    if (!surface || !known.insert(Identity(element)).second) continue;
    found.push_back({std::move(surface), static_cast<int>(i), AsMoving(element) != nullptr});
  }
  return found;
}

Vec3<double> TerrainDisplacement(const RobotDescription& robot, int constraint, double t,
                                 double period) {
  const MovingConstraint* moving =
      AsMoving(*robot.constraints[static_cast<std::size_t>(constraint)]);
  if (moving == nullptr) return Vec3<double>::Zero();
  const Vec3<double> s = moving->motion().At(t)[0];
  if (!IsPlane(moving->still())) return s;
  const std::vector<double> numbers = Numbers(moving->still());
  const Mat3<double> frame =
      AxisFrame(Vec3<double>(numbers[0], numbers[1], numbers[2]).normalized());
  Vec3<double> shown = frame.transpose() * s;
  for (int k = 0; k < 2; ++k) shown(k) -= period * std::round(shown(k) / period);
  return frame * shown;
}

}  // namespace contact_flow
