// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/trajectory_optimization/receding_horizon.h"

namespace contact_flow {

/// The part of a whole problem that is solved at a time.
struct Window {
  TrajectoryProblem problem;  ///< from `begin` on, with the inputs of the whole
  double end = 0;             ///< [s]
  int first = 0;              ///< the instant t_first of the whole at which its first interval ends
};

/// The window that begins at `begin`. Without intervals: the whole is over by then.
Window WindowAt(const HorizonProblem& problem, double begin);

/// Throws std::invalid_argument, "receding horizon: " and `what`, unless `condition` holds.
void RequireHorizon(bool condition, const std::string& what);

/// Throws std::invalid_argument, naming the field, for a problem that has no windows.
void CheckHorizon(const MechanicalSystem& system, const HorizonProblem& problem);

}  // namespace contact_flow
