// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// An input that is constant on each interval of a grid: u(t) = values[k] for grid[k] < t ≤
/// grid[k+1], and beyond the last instant.
struct InputSchedule {
  std::vector<double> grid;    ///< [K], increasing; the run begins at grid[0], mostly 0 [s]
  std::vector<Vector> values;  ///< [K] each [m]

  /// One input from the beginning on.
  static InputSchedule Constant(const VectorRef& u) { return {{0.0}, {u}}; }
};

/// Throws std::invalid_argument, naming entry and value, for a schedule that is not in order.
void Validate(const MechanicalSystem& system, const InputSchedule& schedule);

}  // namespace contact_flow
