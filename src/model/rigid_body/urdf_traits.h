// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <urdf_model/model.h>

#include "contact_flow/model/rigid_body/robot_model.h"
#include "urdf_source.h"

namespace contact_flow {

/// Keeps what is known of joints beyond their geometry.
void ReadTraits(const urdf::ModelInterface& model, RobotModel* robot);
/// Joints that follow others.
void ReadMimics(const urdf::ModelInterface& model, RobotModel* robot, Findings* findings);
/// Tells of limits and losses, which are used where they are asked for.
void WarnOfUnused(const urdf::ModelInterface& model, RobotModel* robot);

}  // namespace contact_flow
