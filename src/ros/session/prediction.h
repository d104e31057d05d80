// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>

#include "contact_flow/OutcomePrediction.h"
#include "contact_flow/PredictionRequest.h"
#include "contact_flow/flow/online_flow.h"
#include "src/ros/request/directions.h"
#include "src/ros/request/request.h"
#include "src/ros/request/setup.h"

namespace contact_flow {
namespace ros_interface {

/// What a prediction starts from: the present of an online run as an initial state, with the inputs
/// to come and the directions in which it is perturbed.
struct Snapshot {
  std::shared_ptr<const Setup> setup;
  Run run;
  Directions directions;
};
/// Throws std::invalid_argument for a request that is not in order.
Snapshot TakeSnapshot(std::shared_ptr<const Setup> setup, OnlineFlow* flow,
                      const PredictionRequest& request);

/// The outcome of a run from the snapshot on, and the fan of its perturbations; the header is left
/// empty. A function of its arguments alone, of which `request` is the one of the snapshot;
/// `cancelled` as in SimulateOptions.
OutcomePrediction Predict(const Snapshot& snapshot, const PredictionRequest& request,
                          const std::function<bool()>& cancelled);

}  // namespace ros_interface
}  // namespace contact_flow
