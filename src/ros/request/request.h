// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/DerivativeOptions.h"
#include "contact_flow/InitialState.h"
#include "contact_flow/InputGrid.h"
#include "contact_flow/RowMajorMatrix.h"
#include "contact_flow/SimulationOptions.h"
#include "src/session/directions.h"
#include "src/session/number_checks.h"
#include "src/session/run_request.h"

/// What messages ask, as plain values, and resolved (session/run_request.h).
namespace contact_flow {
namespace ros_interface {

AskedState FromMsg(const InitialState& message);
AskedOptions FromMsg(const SimulationOptions& message);
AskedDerivativeOptions FromMsg(const DerivativeOptions& message);
/// The directions of a message that has these three fields.
template <class Message>
AskedDirections DirectionsOf(const Message& message) {
  const RowMajorMatrix& matrix = message.direction_matrix;
  return {
      message.directions, {matrix.rows, matrix.cols, matrix.data}, message.project_directions != 0};
}

ResolvedRun ResolveRun(const Setup& setup, double duration, const InitialState& state,
                       const std::vector<double>& input, const InputGrid& input_grid,
                       const SimulationOptions& options);
/// The same from the fields that requests have in common.
template <class Request>
ResolvedRun ResolveRun(const Setup& setup, const Request& request) {
  return ResolveRun(setup, request.duration, request.state, request.input, request.input_grid,
                    request.options);
}
inline SimulateOptions ResolveOptions(const SimulateOptions& defaults,
                                      const SimulationOptions& asked) {
  return contact_flow::ResolveOptions(defaults, FromMsg(asked));
}
inline BDerivativeOptions ResolveOptions(const BDerivativeOptions& defaults,
                                         const DerivativeOptions& asked) {
  return contact_flow::ResolveOptions(defaults, FromMsg(asked));
}

}  // namespace ros_interface
}  // namespace contact_flow
