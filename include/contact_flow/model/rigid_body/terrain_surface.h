// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "contact_flow/model/rigid_body/robot_description.h"

namespace contact_flow {

/// A point of a surface in the world over two parameters, both 0 near where it was asked for [m].
using TerrainSurface = std::function<Vec3<double>(double, double)>;

struct TerrainPiece {
  TerrainSurface surface;  ///< where it is undisplaced
  int constraint;          ///< one that touches it
  bool moves;              ///< with time
};

/// The planes, height fields, height maps and stairs of the world that a robot's constraints touch,
/// each once, near a point; lower by `sink` [m], so that the visual of a floor can hide them.
std::vector<TerrainPiece> TerrainNear(const RobotDescription& robot, const Vec3<double>& near,
                                      double sink = 0);
/// What the surface of a constraint is displaced by at time t [m]. A plane that moves along itself
/// is shown by its pattern, of this period along both parameters: so far it never goes.
Vec3<double> TerrainDisplacement(const RobotDescription& robot, int constraint, double t,
                                 double period);

}  // namespace contact_flow
