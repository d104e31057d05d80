// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/model/configuration_space.h"

namespace contact_flow {

/// The factors of a space in their order, "line", "circle" or "rotation": a text to make it from.
std::vector<std::string> FactorNames(const ConfigurationSpace& space);

/// Its inverse. Throws std::invalid_argument, naming `field` and entry, for another name.
ConfigurationSpace SpaceOfFactors(const std::string& field, const std::vector<std::string>& names);

}  // namespace contact_flow
