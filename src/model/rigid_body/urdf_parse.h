// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <urdf_model/model.h>
#include <urdf_world/types.h>

#include <string>

namespace contact_flow {

/// What urdfdom makes of a text; throws std::invalid_argument with all that it complains of.
urdf::ModelInterfaceSharedPtr ParseByUrdfdom(const std::string& text);

/// Throws std::invalid_argument: "URDF: " and what is wrong.
[[noreturn]] void FailUrdf(const std::string& what);

}  // namespace contact_flow
