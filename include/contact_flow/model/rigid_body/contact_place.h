// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/robot_system.h"

namespace contact_flow {

/// Where constraint i of a robot touches [m], and the force of λ [n+l+r] on the robot there, that
/// of friction with it [N]; both in the world. Of a limit: where its joint's body is, no force.
void PlaceContact(const RobotSystem& system, int i, const TreeState<double>& state,
                  const VectorRef& lambda, Vec3<double>* point, Vec3<double>* force);

}  // namespace contact_flow
