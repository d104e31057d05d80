// SPDX-License-Identifier: BSD-3-Clause
#include "setup.h"

namespace contact_flow {

Setup::Setup(const Configuration& configured)
    : configuration(configured),
      system(WithParameters(configuration.parameters)),
      robot(dynamic_cast<const RobotSystem*>(system.get())),
      options(configuration.options),
      derivative_options(configuration.derivative_options) {
  CheckOptions(options);
  CheckOptions(derivative_options);
}

}  // namespace contact_flow
