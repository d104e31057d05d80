// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/model_plugins.h"

#include <pluginlib/class_loader.hpp>
#include <stdexcept>

#include "contact_flow/model/model_plugin.h"
#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using Loader = pluginlib::ClassLoader<ModelPlugin>;

/// Neither it nor what it has loaded ends before the process: registered factories are code there.
Loader& TheLoader() {
  static auto* loader = new Loader("contact_flow", "contact_flow::ModelPlugin");
  return *loader;
}

/// The sentence of pluginlib without its advice, which fills a screen.
std::string Reason(const std::exception& error) { return Cut(error.what(), 600); }

}  // namespace

void LoadModelPlugins(const std::vector<std::string>& classes) {
  if (classes.empty()) return;  // looking for packages takes a while
  for (const std::string& name : classes) {
    const std::string origin = "model plugin " + QuoteName(name);
    try {
      Loader& loader = TheLoader();
      if (!loader.isClassAvailable(name)) {
        const std::vector<std::string> declared = loader.getDeclaredClasses();
        throw std::invalid_argument(
            declared.empty() ? origin + " is unknown: no package in ROS_PACKAGE_PATH exports any"
                             : UnknownName("model plugin", name, declared));
      }
      RegisterModelsOf(*loader.createUnmanagedInstance(name), origin);
    } catch (const pluginlib::LibraryLoadException& error) {
      throw std::invalid_argument(origin + ": its library cannot be loaded: " + Reason(error));
    } catch (const pluginlib::CreateClassException& error) {
      throw std::invalid_argument(origin + ": its library has no such class: " + Reason(error));
    } catch (const pluginlib::PluginlibException& error) {
      throw std::invalid_argument(origin + ": " + Reason(error));
    }
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
