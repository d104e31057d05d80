// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/LinearizationRequest.h"
#include "contact_flow/TrajectoryLinearization.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The answer of `linearize`, a function of setup and request alone. Throws std::invalid_argument,
/// naming the field, for a request that is not in order.
TrajectoryLinearization Answer(const Setup& setup, const LinearizationRequest& request);

}  // namespace ros_interface
}  // namespace contact_flow
