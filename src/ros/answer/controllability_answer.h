// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/ControllabilityRequest.h"
#include "contact_flow/ControllabilityResult.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The answer of `assess_controllability`, a function of setup and request alone. Throws
/// std::invalid_argument, naming the field, for a request that is not in order.
ControllabilityResult Answer(const Setup& setup, const ControllabilityRequest& request);

}  // namespace ros_interface
}  // namespace contact_flow
