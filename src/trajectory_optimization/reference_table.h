// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>
#include <vector>

#include "contact_flow/flow/input_schedule.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/trajectory_optimization/extended_reference.h"

namespace contact_flow {

/// The interval of the grid that begins at or before t, the first one before the grid.
std::size_t IntervalAt(const std::vector<double>& grid, double t);

/// What changes by the time: inputs on their grid, and the efforts of what follows time at the
/// instants of DrivenSwitches, which come at a steady rate.
class ReferenceTime {
 public:
  /// Of a run under these inputs, which must outlive it.
  ReferenceTime(const MechanicalSystem& system, const Trajectory& run, const InputSchedule& inputs);

  ConstraintSet instants() const { return instants_; }
  /// When something changes, ascending.
  const std::vector<double>& changes() const { return changes_; }
  /// At t: the input, and a mode with the instants that lie behind.
  const Vector& Input(double t) const { return inputs_.values[IntervalAt(inputs_.grid, t)]; }
  ContactMode Mode(ContactMode mode, double t) const;

 private:
  const InputSchedule& inputs_;
  ConstraintSet instants_;
  std::vector<std::pair<int, double>> when_;  // of each instant
  std::vector<double> changes_;
};

/// Fills the table of a phase of the run: from `before` [s] ahead of its begin to `after` [s]
/// behind its end.
void TabulatePhase(const MechanicalSystem& system, const Trajectory& run, const ReferenceTime& time,
                   double before, double after, ReferencePhase* phase);

}  // namespace contact_flow
