// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/CovarianceRequest.h"
#include "contact_flow/CovarianceResult.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The answer of `propagate_covariance`, a function of setup and request alone. Throws
/// std::invalid_argument, naming the field, for a request that is not in order.
CovarianceResult Answer(const Setup& setup, const CovarianceRequest& request);

}  // namespace ros_interface
}  // namespace contact_flow
