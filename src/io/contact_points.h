// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/model/rigid_body/robot_model.h"

namespace contact_flow {

/// What stands for a part of a shape: a sphere, a point (radius 0), or the rim of a wheel.
struct ContactPoint {
  int link;                                   ///< index in RobotModel::links
  Vec3<double> point;                         ///< centre in the link's frame [m]
  double radius = 0;                          ///< [m]
  bool rim = false;                           ///< a circle of this radius about `axis`
  Vec3<double> axis = Vec3<double>::UnitZ();  ///< in the link's frame
};

/// Largest distance by which `points` lie inside the shape that they stand for, and the points.
struct ContactHull {
  std::vector<ContactPoint> points;
  double error = 0;  ///< [m]
};

/// The points of a shape: its centre (sphere), corners (box), two centres (capsule); of a cylinder
/// that turns about its own axis, as a wheel, both rims: all these are exact against a plane. Of
/// any other cylinder two inscribed spheres, where it is longer than wide, else two hexagons; of a
/// mesh the given vertices of its file.
ContactHull ShapePoints(const RobotModel& model, const RobotModel::Shape& shape,
                        const std::vector<Vec3<double>>& vertices);

/// The `most` points that stand for all of them best, fewer where these leave an error of at most
/// `tolerance`: the one that sticks out furthest is added, again and again, judged along 2562
/// directions that are spread evenly. The error is the furthest that is left,
/// beside that of `hull`.
ContactHull Thin(const RobotModel& model, const ContactHull& hull, int most, double tolerance);

}  // namespace contact_flow
