// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "contact_flow/ensemble/sweep.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "contact_flow/types.h"

namespace contact_flow {
namespace ros_interface {

/// How whoever waits for a long answer watches it. All may be left empty.
struct Watch {
  std::function<bool()> cancelled;
  /// Iteration, share that is done, residual or cost, best point so far.
  std::function<void(int iteration, double fraction, double value, const Vector& best)> report;

  /// Of a search for a trajectory also this, before `report`.
  std::function<void(const TrajectoryIteration& iteration)> report_step;
  /// Of a sweep this instead.
  std::function<void(const SweepProgress& progress)> report_sweep;

  bool Cancelled() const { return cancelled && cancelled(); }
};

}  // namespace ros_interface
}  // namespace contact_flow
