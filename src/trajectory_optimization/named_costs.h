// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/derivative/run_cost.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/trajectory_optimization/problem.h"

namespace contact_flow {

/// Σ w (u_j v_i)² as the rate of a running cost; nq positions.
RunCost PowerRate(const TrajectoryProblem& problem, int nq);

/// Its integral along a dense run, by quadrature on the steps of the run.
double PowerOf(const TrajectoryProblem& problem, const Trajectory& run, int nq);

/// ∫ v_i² dt of each power term over each interval of the grid [terms × K].
Matrix SquaresOf(const TrajectoryProblem& problem, const Trajectory& run, int nq);

/// Σ w_c p_c² over the transitions of a run.
double ImpulseOf(const TrajectoryProblem& problem, const Trajectory& run);

}  // namespace contact_flow
