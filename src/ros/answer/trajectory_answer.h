// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/TrajectoryRequest.h"
#include "contact_flow/TrajectoryResult.h"
#include "src/session/setup.h"
#include "watch.h"

namespace contact_flow {
namespace ros_interface {

/// The result of `optimize_trajectory`, a function of setup and request alone unless it is
/// cancelled. Throws std::invalid_argument, naming the field, for a request that is not in order.
TrajectoryResult Answer(const Setup& setup, const TrajectoryRequest& request,
                        const Watch& watch = {});

}  // namespace ros_interface
}  // namespace contact_flow
