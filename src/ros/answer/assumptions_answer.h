// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/AssumptionRequest.h"
#include "contact_flow/TrajectoryAssumptions.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The answer of `check_assumptions`, a function of setup and request alone. Throws
/// std::invalid_argument for a request that is not in order.
TrajectoryAssumptions Answer(const Setup& setup, const AssumptionRequest& request);

}  // namespace ros_interface
}  // namespace contact_flow
