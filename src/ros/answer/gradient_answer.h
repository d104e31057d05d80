// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/GradientRequest.h"
#include "contact_flow/GradientResult.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The answer of `gradient`, a function of setup and request alone. Throws std::invalid_argument,
/// naming the field, for a request that is not in order.
GradientResult Answer(const Setup& setup, const GradientRequest& request);

}  // namespace ros_interface
}  // namespace contact_flow
