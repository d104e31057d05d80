// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "contact_flow/ModelDescription.h"
#include "contact_flow/io/configuration.h"

namespace contact_flow {
namespace ros_interface {

/// All that an answer depends on besides the request: the model and the settings in force. Constant
/// after construction, so that requests may be answered in parallel.
struct Setup {
  explicit Setup(const Configuration& configured);

  /// The same system with other values of its parameters.
  std::unique_ptr<MechanicalSystem> WithParameters(const ParameterValues& values) const {
    return MakeConfigured(configuration, values);
  }

  const Configuration configuration;
  std::unique_ptr<const MechanicalSystem> system;
  const RobotSystem* robot;  ///< the system, if it is a robot, else null
  SimulateOptions options;
  BDerivativeOptions derivative_options;
};

/// Number of output samples of a request that names none, and the most it may ask for.
inline constexpr int kDefaultSamples = 200;
inline constexpr int kMaxSamples = 100000;

/// The setup as a message (header empty), and back: what is needed to repeat a run.
ModelDescription ToMsg(const Setup& setup);
Configuration FromMsg(const ModelDescription& description);

}  // namespace ros_interface
}  // namespace contact_flow
