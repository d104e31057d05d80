// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/PolicyRequest.h"
#include "contact_flow/PolicyResult.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The answer of `make_policy`, a function of setup and request alone. Throws
/// std::invalid_argument, naming the field, for a request that is not in order.
PolicyResult Answer(const Setup& setup, const PolicyRequest& request);

}  // namespace ros_interface
}  // namespace contact_flow
