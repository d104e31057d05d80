// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/StabilityRequest.h"
#include "contact_flow/StabilityResult.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The answer of `assess_stability`, a function of setup and request alone. Throws
/// std::invalid_argument, naming the field, for a request that is not in order.
StabilityResult Answer(const Setup& setup, const StabilityRequest& request);

}  // namespace ros_interface
}  // namespace contact_flow
