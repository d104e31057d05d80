// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "contact_flow/model/rigid_body/robot_system.h"
#include "test/model/rigid_body/mujoco_model.h"

namespace contact_flow {

/// A robot in MuJoCo with a sphere at the point of each of its contacts, above a floor: `condim` 1
/// without friction, 3 with that of the contacts, by elliptic cones.
std::unique_ptr<MujocoModel> OnFeetInMujoco(const RobotSystem& system, int condim);

}  // namespace contact_flow
