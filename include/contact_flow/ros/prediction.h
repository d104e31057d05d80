// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/PredictOutcome.h"
#include "contact_flow/ros/session.h"

namespace contact_flow {
namespace ros_interface {

/// The outcome of a run from the snapshot on, and the fan of its perturbations. A function of its arguments alone;
/// `cancelled` as in SimulateOptions. Throws std::invalid_argument for a request that is not in order.
void Predict(const Session::Snapshot& snapshot, const PredictOutcome::Request& request,
             const std::function<bool()>& cancelled, PredictOutcome::Response* response);

}  // namespace ros_interface
}  // namespace contact_flow
