// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <urdf_model/model.h>
#include <urdf_world/types.h>

#include <string>

namespace contact_flow {

/// What urdfdom makes of a text; throws std::invalid_argument with all that it complains of.
urdf::ModelInterfaceSharedPtr ParseByUrdfdom(const std::string& text);

}  // namespace contact_flow
