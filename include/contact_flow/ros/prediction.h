// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>

#include "contact_flow/OutcomePrediction.h"
#include "contact_flow/PredictionRequest.h"
#include "contact_flow/flow/input_schedule.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/ros/setup.h"

namespace contact_flow {
namespace ros_interface {

/// What a prediction starts from: the present of an online run as an initial state, and the inputs
/// to come.
struct Snapshot {
  std::shared_ptr<const Setup> setup;
  Vector x;
  InputSchedule inputs;
};
Snapshot TakeSnapshot(std::shared_ptr<const Setup> setup, OnlineFlow* flow);

/// Throws std::invalid_argument for a horizon or a size out of range.
void CheckRequest(const PredictionRequest& request);

/// The outcome of a run from the snapshot on, and the fan of its perturbations; the header is left
/// empty. A function of its arguments alone; `cancelled` as in SimulateOptions. Throws
/// std::invalid_argument for a request that is not in order.
OutcomePrediction Predict(const Snapshot& snapshot, const PredictionRequest& request,
                          const std::function<bool()>& cancelled);

}  // namespace ros_interface
}  // namespace contact_flow
