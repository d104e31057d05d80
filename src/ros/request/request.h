// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/ComparisonRequest.h"
#include "contact_flow/DerivativeRequest.h"
#include "contact_flow/InputGrid.h"
#include "contact_flow/SimulationRequest.h"
#include "contact_flow/flow/input_schedule.h"
#include "setup.h"

namespace contact_flow {
namespace ros_interface {

/// Longest run that may be asked for [s], and most intervals of its input.
inline constexpr double kMaxDuration = 1e6;
inline constexpr std::size_t kMaxIntervals = 10000;

/// A run as asked for, every default filled in.
struct Run {
  Vector x;             ///< (q, v) at time 0 [2d]
  InputSchedule input;  ///< with one interval for a constant input
  double duration = 0;  ///< [s]
  SimulateOptions options;
};

/// Fill in the defaults of the model and of the node. Throw std::invalid_argument with the field
/// (and index) and the value, for sizes, numbers that are not finite or out of range, and unknown
/// names, these with the nearest valid one. What the state must obey besides, Simulate checks.
Run ResolveRun(const Setup& setup, double duration, const InitialState& state,
               const std::vector<double>& input, const InputGrid& input_grid,
               const SimulationOptions& options);
/// The same from the fields that requests have in common.
template <class Request>
Run ResolveRun(const Setup& setup, const Request& request) {
  return ResolveRun(setup, request.duration, request.state, request.input, request.input_grid,
                    request.options);
}
SimulateOptions ResolveOptions(SimulateOptions defaults, const SimulationOptions& asked);
BDerivativeOptions ResolveOptions(BDerivativeOptions defaults, const DerivativeOptions& asked);
/// Writes what is asked for over the state x [nq+d]; messages name the field and its index.
void ApplyState(const MechanicalSystem& system, const InitialState& state, Vector* x);
/// Writes values over `vector`, by name, or all of them where there are no names; `what` the names
/// are of, as "input".
void ApplyNamed(const std::string& what, const std::vector<std::string>& names,
                const std::vector<double>& values, const std::vector<std::string>& valid,
                Vector* vector);
/// A count: `asked`, or `standard` for 0, at most `largest`.
int ResolveCount(const std::string& field, std::uint32_t asked, int standard, int largest);
/// Sizes of perturbation, 1e-2 … 1e-6 when none are given.
std::vector<double> ResolveAlphas(const std::vector<double>& asked);

/// Throws unless all numbers are finite, as "state.q[3] is nan, expected a finite number".
void CheckFinite(const std::string& field, const std::vector<double>& numbers);
/// Finite and not negative.
void CheckWeights(const std::string& field, const std::vector<double>& weights);
/// Throws unless there are `size` numbers, as "state.q has 3 entries, expected 7: body_x, …".
void CheckSize(const std::string& field, std::size_t actual, std::size_t size,
               const std::vector<std::string>& names);

}  // namespace ros_interface
}  // namespace contact_flow
