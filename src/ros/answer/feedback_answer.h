// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/StepFeedbackRequest.h"
#include "contact_flow/StepFeedbackResult.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The answer of `find_stabilizing_feedback`, a function of setup and request alone. Throws
/// std::invalid_argument, naming the field, for a request that is not in order.
StepFeedbackResult Answer(const Setup& setup, const StepFeedbackRequest& request);

}  // namespace ros_interface
}  // namespace contact_flow
