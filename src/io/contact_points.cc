// SPDX-License-Identifier: BSD-3-Clause
#include "contact_points.h"

#include <algorithm>
#include <cmath>

#include "contact_flow/model/rigid_body/kinematics.h"

namespace contact_flow {
namespace {

using Kind = RobotModel::Shape::Kind;

constexpr int kDirections = 2562;
constexpr int kCorners = 6;  // of a polygon in a circle

/// Cosine of the tilt below which what turns about an upright axis is a rotor and no wheel.
constexpr double kUpright = 0.98;

/// Whether a cylinder turns about its own axis, and does not lie on its face where all joints are
/// zero, as rotors and turntables do: the circle of a rim that lies has no lowest point.
bool IsWheel(const RobotModel& model, const RobotModel::Shape& shape) {
  const RobotModel::Link& link = model.links[shape.link];
  if (link.body < 0) return false;
  if (model.tree.bodies()[link.body].joint != JointKind::kRevolute) return false;
  const Pose pose = link.pose * shape.pose;  // in the body, which turns about its z
  const double off = pose.position.head<2>().norm();
  if (std::abs(pose.rotation(2, 2)) <= 1 - 1e-6 || off >= 1e-3 * shape.size(0)) return false;
  TreeState<double> state(model.tree);
  UpdatePositions(model.tree, model.tree.Neutral().data(), &state);
  return std::abs(state.body[link.body].rotation(2, 2)) < kUpright;
}

/// n directions along a spiral from pole to pole, each for the same share of the sphere.
std::vector<Vec3<double>> Directions(int n) {
  std::vector<Vec3<double>> directions;
  const double turn = M_PI * (3 - std::sqrt(5.));
  for (int k = 0; k < n; ++k) {
    const double z = 1 - (2 * k + 1.) / n, r = std::sqrt(1 - z * z);
    directions.emplace_back(r * std::cos(k * turn), r * std::sin(k * turn), z);
  }
  return directions;
}

}  // namespace

ContactHull ShapePoints(const RobotModel& model, const RobotModel::Shape& shape,
                        const std::vector<Vec3<double>>& vertices) {
  ContactHull hull;
  const auto add = [&](const Vec3<double>& local, double radius) {
    hull.points.push_back({shape.link, shape.pose * local, radius});
  };
  const double radius = shape.size(0), half = 0.5 * shape.size(1);
  switch (shape.kind) {
    case Kind::kSphere:
      add(Vec3<double>::Zero(), radius);
      break;
    case Kind::kBox:
      for (int k = 0; k < 8; ++k) {
        const Vec3<double> sign(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
        add(0.5 * sign.cwiseProduct(shape.size), 0);
      }
      break;
    case Kind::kCapsule:
      for (const double z : {-half, half}) add({0, 0, z}, radius);
      break;
    case Kind::kCylinder:
      for (const double side : {-1., 1.}) {
        if (IsWheel(model, shape)) {
          add({0, 0, side * half}, radius);
          hull.points.back().rim = true;
          hull.points.back().axis = shape.pose.rotation.col(2);
        } else if (half >= radius) {
          add({0, 0, side * (half - radius)}, radius);
          hull.error = (std::sqrt(2.) - 1) * radius;  // at the edges
        } else {
          for (int k = 0; k < kCorners; ++k) {
            const double angle = 2 * M_PI * k / kCorners;
            add({radius * std::cos(angle), radius * std::sin(angle), side * half}, 0);
          }
          hull.error = (1 - std::cos(M_PI / kCorners)) * radius;
        }
      }
      break;
    case Kind::kMesh:
      for (const Vec3<double>& vertex : vertices) add(vertex.cwiseProduct(shape.size), 0);
  }
  return hull;
}

ContactHull Thin(const RobotModel& model, const ContactHull& hull, int most, double tolerance) {
  const std::vector<Vec3<double>> directions = Directions(kDirections);
  std::vector<Vec3<double>> centres;  // in the body
  for (const ContactPoint& point : hull.points) {
    centres.push_back(model.links[point.link].pose * point.point);
  }
  // How far the points reach along each direction, which one does, and how far those taken do.
  std::vector<double> reach(directions.size()), taken(directions.size(), -HUGE_VAL);
  std::vector<std::size_t> furthest(directions.size());
  for (std::size_t d = 0; d < directions.size(); ++d) {
    reach[d] = -HUGE_VAL;
    for (std::size_t i = 0; i < centres.size(); ++i) {
      const double far = directions[d].dot(centres[i]) + hull.points[i].radius;
      if (far > reach[d]) {
        reach[d] = far;
        furthest[d] = i;
      }
    }
  }
  ContactHull thin;
  while (static_cast<int>(thin.points.size()) < most) {
    std::size_t worst = 0;
    for (std::size_t d = 0; d < directions.size(); ++d) {
      if (reach[d] - taken[d] > reach[worst] - taken[worst]) worst = d;
    }
    if (reach[worst] - taken[worst] <= tolerance) break;
    const std::size_t i = furthest[worst];
    thin.points.push_back(hull.points[i]);
    for (std::size_t d = 0; d < directions.size(); ++d) {
      taken[d] = std::max(taken[d], directions[d].dot(centres[i]) + hull.points[i].radius);
    }
  }
  for (std::size_t d = 0; d < directions.size(); ++d) {
    thin.error = std::max(thin.error, reach[d] - taken[d]);
  }
  thin.error += hull.error;
  return thin;
}

}  // namespace contact_flow
