// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "contact_flow/model/rigid_body/robot_description.h"

namespace contact_flow {

/// A point of a surface in the world over two parameters, both 0 near where it was asked for [m].
using TerrainSurface = std::function<Vec3<double>(double, double)>;

/// The planes, height fields, height maps and stairs of the world that a robot's constraints touch,
/// each once, near a point; lower by `sink` [m], so that the visual of a floor can hide them.
std::vector<TerrainSurface> TerrainNear(const RobotDescription& robot, const Vec3<double>& near,
                                        double sink = 0);

}  // namespace contact_flow
