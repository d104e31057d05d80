// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "contact_flow/trajectory_optimization/problem.h"

namespace contact_flow {

/// True when Ipopt, which multiple shooting needs, is compiled in.
bool HaveIpopt();

/// Settings of multiple shooting beside those of every search for a trajectory.
struct ShootingOptions {
  /// Instants of the grid at which segments begin, of 1 … K−1, in their order; empty: those where
  /// the run that it begins with touches nothing, at most about 20.
  std::vector<int> segments;
  Matrix states;  ///< where segments begin the search [nq+d × segments]; empty: on that run
  double tolerance = 1e-9;  ///< of Ipopt: the scaled conditions of first order
};

/// Minimises the cost of a trajectory by multiple shooting: the run is made of segments between
/// instants of the grid, whose initial states are unknowns, too,
///   min Σ_j J_j(u, x_j)    under    φ_j(x_j, u) = x_{j+1},  l ≤ c ≤ u,
/// by Ipopt, with the exact first derivatives of each segment and the second order by its own
/// quasi-Newton method. What a run must hold on its way is then not carried through all of it, and
/// a search may begin with `states` that no run joins. Pieces are not looked at: where the cost has
/// a kink at the end the search stalls, and OptimizeTrajectory says why.
///
/// The verdict is kSmoothMinimum where Ipopt has converged, without certificate; y, inputs and
/// cost are those of one run, beginning with the first segment. Throws std::runtime_error without
/// Ipopt, and std::invalid_argument like Unknowns; also where parameters, lengths of intervals or
/// no inputs are chosen, for conditions on touchdowns, for a system whose positions are no ℝᵈ, and
/// for segments that begin where contacts touch.
TrajectoryOptimum OptimizeByShooting(const MechanicalSystem& system,
                                     const TrajectoryProblem& problem,
                                     const TrajectoryOptions& options = {},
                                     const ShootingOptions& shooting = {});

}  // namespace contact_flow
