// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asked.h"
#include "contact_flow/flow/input_schedule.h"
#include "setup.h"

namespace contact_flow {

/// Longest run that may be asked for [s], and most intervals of its input.
inline constexpr double kMaxDuration = 1e6;
inline constexpr std::size_t kMaxIntervals = 10000;

/// A run as asked for, every default filled in.
struct ResolvedRun {
  Vector x;             ///< (q, v) at time 0 [nq+d]
  InputSchedule input;  ///< with one interval for a constant input
  double duration = 0;  ///< [s]
  SimulateOptions options;
};

/// Fill in the defaults of the model and of the settings in force. Throw std::invalid_argument with
/// the field (and index) and the value, for sizes, numbers that are not finite or out of range, and
/// unknown names, these with the nearest valid one. What else a state must obey is checked by
/// Simulate itself.
ResolvedRun ResolveRun(const Setup& setup, const AskedRun& asked);
SimulateOptions ResolveOptions(SimulateOptions defaults, const AskedOptions& asked);
BDerivativeOptions ResolveOptions(BDerivativeOptions defaults, const AskedDerivativeOptions& asked);
/// Writes what is asked for over the state x [nq+d]; messages name the field and its index.
void ApplyState(const MechanicalSystem& system, const AskedState& state, Vector* x);
/// Writes values over `vector`, by name, or all of them where there are no names; `what` the names
/// are of, as "input".
void ApplyNamed(const std::string& what, const std::vector<std::string>& names,
                const std::vector<double>& values, const std::vector<std::string>& valid,
                Vector* vector);
/// A count: `asked`, or `standard` for 0, at most `largest`.
int ResolveCount(const std::string& field, std::uint32_t asked, int standard, int largest);
/// Sizes of perturbation, 1e-2 … 1e-6 when none are given.
std::vector<double> ResolveAlphas(const std::vector<double>& asked);

}  // namespace contact_flow
