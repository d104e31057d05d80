// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/TrajectoryRequest.h"
#include "contact_flow/trajectory_optimization/problem.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// What a request asks `optimize_trajectory`; `setup` must outlive it. Throws
/// std::invalid_argument, naming the field, for a request that is not in order.
TrajectoryProblem ResolveProblem(const Setup& setup, const TrajectoryRequest& request);

}  // namespace ros_interface
}  // namespace contact_flow
