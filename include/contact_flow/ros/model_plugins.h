// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace contact_flow {
namespace ros_interface {

/// Loads shared libraries of models by pluginlib, each by the lookup name of its class, as
/// "my_models/Models", and registers their models. A package offers such classes by
/// `contact_flow plugin="${prefix}/models.xml"` in the export section of its package.xml; see
/// model/model_plugin.h. The libraries stay loaded. Throws std::invalid_argument, naming the class,
/// for one that no package declares (with the nearest that is), a library that is missing or cannot
/// be loaded, another ABI, and names of models that are taken.
void LoadModelPlugins(const std::vector<std::string>& classes);

}  // namespace ros_interface
}  // namespace contact_flow
