// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "contact_flow/flow/input_schedule.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/trajectory_optimization/policy.h"

namespace contact_flow {

/// A run under a tracker's inputs, each held until the next.
struct Rollout {
  Status status;
  Vector x;                  ///< at its end, right limit [nq+d]
  ContactMode mode;          ///< there
  std::vector<int> changes;  ///< how often each constraint touches down or lets go [n]
  InputSchedule inputs;
};

/// From x at times[0] to `end` with the inputs that the tracker gives at `times`, at which it is
/// told of all events since. Where a contact is met at `end` it is behind that. Throws
/// std::invalid_argument for states that are none.
Rollout RollOut(const std::shared_ptr<const MechanicalSystem>& system, PolicyTracker* tracker,
                const std::vector<double>& times, double end, const Vector& x,
                const SimulateOptions& options);

}  // namespace contact_flow
