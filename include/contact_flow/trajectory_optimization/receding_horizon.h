// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/trajectory_optimization/policy.h"
#include "contact_flow/trajectory_optimization/problem.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What is solved again and again: a problem over all the time, of which each solve takes a window.
struct HorizonProblem {
  /// Its grid is that of all windows. Inputs alone are chosen, conditions are those of states at
  /// instants of the grid, of which a window has those inside it.
  TrajectoryProblem whole;
  /// In place of `target` a g for each instant t_1 … t_K at which a window may end [nq+d × K]; or
  /// empty: all windows have that of the whole.
  Matrix goals;
  int intervals = 0;  ///< of the grid in a window, fewer near the end; 0: all that are left
};

/// To follow the reference of a policy: ū and x̄ of its grid with these weights, each as in
/// TrajectoryProblem, and its bounds.
HorizonProblem FollowReference(const TrackingPolicy& policy, const Vector& effort,
                               const Vector& path_weight, const Vector& weight, int intervals);

/// Settings of solves.
struct HorizonOptions {
  TrackingWeights weights;  ///< of the feedback between two solves
  double reach = 0.1;       ///< of its reference beyond events [s]
  double budget = 0.05;     ///< of one solve, by the clock [s]; may be infinite
  int max_iterations = 20;  ///< of one solve
  double tolerance = 1e-6;  ///< promised decrease that counts as none, relative to 1 + J
  double period = 1e-3;     ///< of the loop's inputs, for what happens until a solution begins [s]
  std::function<bool()> cancelled;  ///< asked now and then; true ends a solve
};

/// What a solve is asked: the loop at t, and when its solution is to begin.
struct HorizonTask {
  double t = 0;                                  ///< [s]
  Vector x;                                      ///< measured at t [nq+d]
  double begin = 0;                              ///< ≥ t [s]
  std::shared_ptr<const TrackingPolicy> policy;  ///< that is followed
  PolicyTracker tracker;                         ///< as it is at t
  std::vector<int> changes;  ///< how often each constraint has touched down or let go [n]
};

/// How a solve ended.
enum class HorizonVerdict {
  kSolved = 0,      ///< at a minimum
  kUnfinished = 1,  ///< its time or iterations were over, or no step helped: its best is followed
  kLate = 2,        ///< there was no policy when its time was over: the last one is kept
  kFailed = 3,      ///< there is none, and why: the last one is kept
};

/// "solved", …
const char* VerdictName(HorizonVerdict verdict);

/// What a solve has found.
struct HorizonSolution {
  HorizonVerdict verdict = HorizonVerdict::kFailed;  ///< how it ended
  std::string message;                               ///< as a sentence
  double t = 0;                                      ///< of its task [s]
  double begin = 0;                                  ///< of its task [s]
  std::shared_ptr<const TrackingPolicy> policy;      ///< from `begin` on; null: the last is kept
  Vector x;                                          ///< where it begins [nq+d]
  ContactMode mode;                                  ///< in which, and …
  std::vector<int> changes;  ///< … what will have happened by then, as in the task [n]
  double first_cost = 0;     ///< of the last solution, shifted; NaN where it ended before [J]
  double cost = 0;           ///< of this one [J]
  int iterations = 0;        ///< of the search
  double seconds = 0;        ///< that it took, by the clock [s]
};

/// Solves the window of a problem that begins at task.begin:
///   1. the loop goes on from x to there, under the policy that is followed;
///   2. the search begins with the inputs of that policy, shifted to where the window is, beyond
///      its end with those of the whole problem; or with what its feedback does with them, held
///      over the intervals of the grid, where that costs less;
///   3. what is found gets a feedback of its own.
/// The search takes three quarters of the budget at most, so that the rest is left for the
/// feedback. The first interval of a window is what is left of one of the grid, and the next one
/// with it where less than a quarter is. Nothing that is found depends on the clock, but whether
/// it is. Throws std::invalid_argument for problems and options that are not in order; what lies
/// at the state is kFailed.
HorizonSolution SolveHorizon(const std::shared_ptr<const MechanicalSystem>& system,
                             const HorizonProblem& problem, const HorizonOptions& options,
                             const HorizonTask& task);

/// The policy of the whole problem under its own inputs, which a loop begins with. Throws as
/// MakePolicy does.
TrackingPolicy FirstPolicy(const MechanicalSystem& system, const HorizonProblem& problem,
                           const HorizonOptions& options);

}  // namespace contact_flow
