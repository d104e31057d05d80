// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <functional>
#include <set>

#include "contact_flow/model/rigid_body/constraint/height_field.h"
#include "contact_flow/model/rigid_body/constraint/height_map.h"
#include "contact_flow/model/rigid_body/constraint/plane.h"
#include "contact_flow/model/rigid_body/constraint/stairs.h"
#include "contact_flow/ros/robot_display.h"
#include "geometry.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using constraint::HeightField;
using constraint::HeightMap;
using constraint::Plane;
using constraint::Stairs;
using visualization_msgs::Marker;

/// Tiles along each side of a surface.
constexpr int kTiles = 40;
/// How far below the surface it is drawn, so that the visual of a table or floor hides it [m].
constexpr double kSink = 2e-3;

/// A point of a surface over its two parameters [m].
using Surface = std::function<Vec3<double>(double, double)>;

std::vector<double> Numbers(const ConstraintElement& element) {
  std::vector<double> numbers;
  for (const Parameter& number : element.parts.numbers) numbers.push_back(number.value);
  return numbers;
}

/// The surface of a constraint of this kind, near a point; empty for another kind.
Surface SurfaceOf(const ConstraintElement& element, const Vec3<double>& near) {
  const std::vector<double> numbers = Numbers(element);
  if (dynamic_cast<const ConstraintOf<Plane>*>(&element) != nullptr) {
    const Vec3<double> normal = Vec3<double>(numbers[0], numbers[1], numbers[2]).normalized();
    const Mat3<double> frame = AxisFrame(normal);
    const Vec3<double> foot = near + (numbers[3] - kSink - normal.dot(near)) * normal;
    return [=](double s, double t) -> Vec3<double> {
      return foot + s * frame.col(0) + t * frame.col(1);
    };
  }
  if (dynamic_cast<const ConstraintOf<HeightField>*>(&element) != nullptr) {
    return [=](double s, double t) {
      double z[] = {near(0) + s, near(1) + t, 0};
      return Vec3<double>(z[0], z[1], -HeightField::Gap(numbers.data(), z) - kSink);
    };
  }
  if (dynamic_cast<const ConstraintOf<Stairs>*>(&element) != nullptr) {
    return [=](double s, double t) {
      double z[] = {near(0) + s, near(1) + t, 0};
      return Vec3<double>(z[0], z[1], -Stairs::Gap(numbers.data(), z) - kSink);
    };
  }
  if (dynamic_cast<const ConstraintOf<HeightMap>*>(&element) != nullptr) {
    const std::shared_ptr<const HeightGrid> heights = element.parts.heights;
    return [=](double s, double t) {
      double z[] = {near(0) + s, near(1) + t, 0};
      return Vec3<double>(z[0], z[1], -HeightMap::Gap(*heights, numbers.data(), z) - kSink);
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

/// Triangles in two alternating shades.
void AddTiles(const Surface& surface, double half_width, Marker* marker) {
  const double tile = 2 * half_width / kTiles;
  const auto corner = [&](int i, int j) {
    return ToPoint(surface(i * tile - half_width, j * tile - half_width));
  };
  for (int i = 0; i < kTiles; ++i) {
    for (int j = 0; j < kTiles; ++j) {
      const double shade = (i / 2 + j / 2) % 2 == 0 ? 0.62 : 0.72;
      for (const auto& step : {std::make_pair(0, 0), {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}}) {
        marker->points.push_back(corner(i + step.first, j + step.second));
        marker->colors.push_back(Color(shade, shade, shade, 1));
      }
    }
  }
}

}  // namespace

visualization_msgs::MarkerArray RobotDisplay::Terrain() const {
  const RigidBodyTree& tree = system_.robot().model.tree;
  TreeState<double> state(tree);
  UpdatePositions(tree, system_.nominal().x.data(), &state);
  visualization_msgs::MarkerArray array;
  std::set<std::vector<double>> drawn;
  for (const auto& element : system_.robot().constraints) {
    const Surface surface = SurfaceOf(*element, state.reference);
    if (!surface || !drawn.insert(Identity(*element)).second) continue;
    Marker marker = Begin("terrain", static_cast<int>(array.markers.size()), ros::Time());
    marker.type = Marker::TRIANGLE_LIST;
    marker.scale.x = marker.scale.y = marker.scale.z = 1;
    marker.color = Color(0.7, 0.7, 0.7, 1);
    AddTiles(surface, options_.terrain_size, &marker);
    array.markers.push_back(marker);
  }
  return array;
}

}  // namespace ros_interface
}  // namespace contact_flow
