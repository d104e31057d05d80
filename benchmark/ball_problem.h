// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"

namespace contact_flow {
namespace benchmark {

/// The ball of Kong, Payne, Council and Johnson (arXiv 2103.14584): 251 inputs of 4 ms from 4 m at
/// rest to 1 m at rest, with one bounce.
struct BallProblem {
  explicit BallProblem(double input);

  std::unique_ptr<MechanicalSystem> system;
  TrajectoryProblem problem;
};

/// Where a peer ended.
struct PeerOptimum {
  double cost = 0;
  long simulations = 0;  ///< plain runs
  long derivatives = 0;  ///< and runs with their derivative
  double seconds = 0;
  std::string message;
};

/// Hybrid iLQR with saltation matrices and extended references, which knows nothing of pieces: a
/// backward pass along the run, and a forward pass with its gains and a line search.
PeerOptimum RunHybridIlqr(const BallProblem& ball);

/// NLopt's L-BFGS by exact gradients, or by one-sided differences of plain runs; it stops where the
/// cost `enough` is reached. No message where it is not built in.
PeerOptimum RunNlopt(const BallProblem& ball, bool differences, double enough);

}  // namespace benchmark
}  // namespace contact_flow
