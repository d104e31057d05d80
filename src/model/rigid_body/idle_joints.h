// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/model/rigid_body/robot_model.h"

namespace contact_flow {

/// Joints that move no mass, so that nothing else feels where they are: what they carry has no mass
/// and no inertia, or is a point mass on their axis. After JoinInertias.
std::vector<std::string> IdleJoints(const RobotModel& robot);

}  // namespace contact_flow
