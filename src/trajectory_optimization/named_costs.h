// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/derivative/run_cost.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/trajectory_optimization/problem.h"

namespace contact_flow {

/// Σ w (u_j v_i)² + Σ w_c |T_c v|² as the rate of a running cost of runs of the system.
RunCost RunningRate(const TrajectoryProblem& problem, const MechanicalSystem& system);

/// Its integral along a dense run, by quadrature on the steps of the run.
double RunningCostOf(const TrajectoryProblem& problem, const MechanicalSystem& system,
                     const Trajectory& run);

/// ∫ v_i² dt of each power term over each interval of the grid [terms × K]; nq positions.
Matrix SquaresOf(const TrajectoryProblem& problem, const Trajectory& run, int nq);

/// Σ w_c p_c² over the transitions of a run.
double ImpulseOf(const TrajectoryProblem& problem, const Trajectory& run);

}  // namespace contact_flow
