// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "contact_flow/model/rigid_body/robot_system.h"
#include "test/model/rigid_body/mujoco_model.h"

namespace contact_flow {

/// A robot in MuJoCo with a sphere of this radius [m] at the point of each of its contacts, above a
/// floor: `condim` 1 without friction, 3 with that of the contacts, by elliptic cones.
std::unique_ptr<MujocoModel> OnFeetInMujoco(const RobotSystem& system, int condim,
                                            double radius = 0.02);

}  // namespace contact_flow
