// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/OptimizationRequest.h"
#include "contact_flow/OptimizationResult.h"
#include "src/session/setup.h"
#include "watch.h"

namespace contact_flow {
namespace ros_interface {

/// The result of `optimize`, a function of setup and request alone unless it is cancelled. Throws
/// std::invalid_argument, naming the field, for a request that is not in order.
OptimizationResult Answer(const Setup& setup, const OptimizationRequest& request,
                          const Watch& watch = {});

}  // namespace ros_interface
}  // namespace contact_flow
