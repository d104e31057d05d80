// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/io/configuration.h"
#include "src/ros/simulator/simulator.h"

namespace contact_flow {
namespace ros_interface {

/// The private parameters of the node.
struct NodeParameters {
  /// ~model, ~parameters, ~options, ~derivative_options, on top of ~model_file; ~robot and
  /// ~robot_description instead of a model
  Configuration configuration;
  std::vector<std::string> model_plugins;  ///< ~model_plugins: classes of pluginlib
  bool record = false;                     ///< ~record: record from the start
  std::string bag_name;                    ///< ~bag_name: of that bag; "": model and time
  std::string bag_directory;               ///< ~bag_directory
  long threads = 4;                        ///< ~threads: long requests answered at once
  long queue = 16;                         ///< ~queue: long requests that may wait for these
  double max_memory = -1;  ///< ~max_memory [10⁶ byte]; 0: no limit, -1: see LimitMemory
  SimulatorParameters simulator;
};

/// Everything under the node's private name, for a MapReader called after the node.
YAML::Node PrivateParameters();

/// The model of a map of parameters: model, parameters, options, derivative_options, on top of
/// model_file; robot and robot_description instead of a model. `name` is that of the map.
Configuration ReadModelParameters(MapReader* reader, const std::string& name);

/// Reads everything under the node's private name. Throws std::invalid_argument, naming the
/// parameter, for one that is unknown (with the nearest that is not), or has the wrong type or a
/// value out of range.
NodeParameters ReadNodeParameters();

}  // namespace ros_interface
}  // namespace contact_flow
