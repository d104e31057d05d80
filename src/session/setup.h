// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "contact_flow/io/configuration.h"

namespace contact_flow {

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

}  // namespace contact_flow
