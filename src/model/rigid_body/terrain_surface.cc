// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/rigid_body/terrain_surface.h"

#include <memory>
#include <set>
#include <utility>

#include "src/model/rigid_body/constraint/height_field.h"
#include "src/model/rigid_body/constraint/height_map.h"
#include "src/model/rigid_body/constraint/plane.h"
#include "src/model/rigid_body/constraint/stairs.h"

namespace contact_flow {
namespace {

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
  if (dynamic_cast<const ConstraintOf<HeightMap>*>(&element) != nullptr) {
    const std::shared_ptr<const HeightGrid> heights = element.parts.heights;
    return [=](double s, double t) {
      double z[] = {near(0) + s, near(1) + t, 0};
      return Vec3<double>(z[0], z[1], -HeightMap::Gap(*heights, numbers.data(), z) - sink);
    };
  }
  return {};
}

/// What makes two surfaces the same: their numbers without the radius of the sphere above a plane.
std::vector<double> Identity(const ConstraintElement& element) {
  std::vector<double> numbers = Numbers(element);
  if (dynamic_cast<const ConstraintOf<Plane>*>(&element) != nullptr) numbers.pop_back();
  return numbers;
}

}  // namespace

std::vector<TerrainSurface> TerrainNear(const RobotDescription& robot, const Vec3<double>& near,
                                        double sink) {
  std::vector<TerrainSurface> found;
  std::set<std::vector<double>> known;
  for (const auto& element : robot.constraints) {
    TerrainSurface surface = SurfaceOf(*element, near, sink);
    if (surface && known.insert(Identity(*element)).second) found.push_back(std::move(surface));
  }
  return found;
}

}  // namespace contact_flow
