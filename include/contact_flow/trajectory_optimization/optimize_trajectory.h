// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "contact_flow/trajectory_optimization/piece_models.h"
#include "contact_flow/trajectory_optimization/problem.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// How a search ended.
enum class TrajectoryVerdict {
  kSmoothMinimum = 0,  ///< no direction makes the cost smaller to first order; one piece
  kValley = 1,         ///< none on any of the pieces that meet here: a minimum on a kink
  kStalled = 2,        ///< some step should make it smaller, but none did
  kUndefined = 3,      ///< cost or derivative are not to be had at the start
  kMaxIterations = 4,  ///< were made
  kCancelled = 5,      ///< by the caller, or a budget has ended
  kInfeasible = 7,     ///< the conditions are not met, and no further multipliers help
};

/// "smooth minimum", …
const char* VerdictName(TrajectoryVerdict verdict);

/// What an iteration met.
enum class KinkStatus {
  kNone = 0,       ///< one piece
  kFollowed = 1,   ///< a step along a kink
  kPassed = 2,     ///< from a kink into the piece where the cost falls
  kRidge = 3,      ///< the same, and it falls on other pieces, too
  kNeighbour = 4,  ///< events and changes of the input were put into an adjacent order
};

/// "none", …
const char* KinkStatusName(KinkStatus status);

/// One iterate.
struct TrajectoryIteration {
  int iteration = 0;     ///< from 0 on
  double cost = 0;       ///< J there
  double best = 0;       ///< least so far; with conditions that of the best by L (Multipliers)
  double violation = 0;  ///< largest of the conditions, in their own units
  double step = 0;       ///< |δy|_∞ of the step that led here
  int pieces = 0;        ///< that met where it began
  KinkStatus kink = KinkStatus::kNone;  ///< what it met
};

/// One of the events that coincide at the end.
struct KinkSlope {
  std::string first;   ///< in the order of the piece
  std::string second;  ///< the later one
  double apart = 0;    ///< time between them [s]
  double slope = 0;    ///< by which the cost rises for each second between them [1/s]
};

/// A piece at the end: what shows that the cost does not fall on it.
struct PieceProof {
  std::string label;              ///< the order of its events
  std::vector<KinkSlope> slopes;  ///< z ≥ 0 with g = Aᵀz
  double residual = 0;            ///< |g − Aᵀz|, largest entry off the bounds
  double decrease = 0;            ///< that its model promises still
  double hull_weight = 0;         ///< w ≥ 0, Σ w = 1, of the smallest |Σ w_i g_i|
};

/// Settings of the search.
struct TrajectoryOptions {
  int max_iterations = 500;  ///< steps, all attempts together
  /// Promised decrease that counts as none, relative to 1 + J. Where J is small beside 1, without
  /// conditions, steps that make it smaller go on to 1e-8 J.
  double tolerance = 1e-10;
  bool neighbours = false;  ///< from a valley, adjacent orders of event and input change in turn
  std::size_t max_pieces = 720;  ///< that meet at one point
  bool certify = true;           ///< false: minima come without certificate, and a derivative less
  /// Asked after every iteration, with the unknowns; false ends the search.
  std::function<bool(const TrajectoryIteration&, const Vector& y)> progress;
};

/// Where a search ended.
struct TrajectoryOptimum {
  TrajectoryVerdict verdict = TrajectoryVerdict::kUndefined;  ///< how it ended
  std::string message;                                        ///< as a sentence
  Vector y;                 ///< the best iterate, as Unknowns orders it
  Vector x;                 ///< its initial state [nq+d]
  InputSchedule inputs;     ///< its inputs, held or at the instants of the grid
  Vector input_end;         ///< and at T, where they are led linearly [m]
  Vector parameters;        ///< those that were chosen, as choose_parameters
  double duration = 0;      ///< its horizon [s]
  double cost = 0;          ///< of a plain run
  Vector condition_values;  ///< c of the conditions
  Vector multipliers;  ///< λ: J falls by λ_i for each unit by which bound i is relaxed upward
  std::vector<PieceProof> certificate;  ///< where the verdict is a minimum
  double hull_distance = 0;  ///< |Σ w_i g_i|: 0 where 0 is in the hull of the pieces' gradients
  std::vector<TrajectoryIteration> iterations;  ///< in their order
  int valleys = 0;                              ///< that were met
  long simulations = 0;                         ///< plain runs
  long derivatives = 0;                         ///< and runs with their derivative
};

/// Minimises the cost of a trajectory by its true derivative: steps of Gauss and Newton on the
/// pieces of the outcome, each of which holds while events and changes of the input stay in order,
///   min_i  min_d  g_iᵀd + ½ dᵀH_i d,   slack_i + A_i d ≥ 0,  bounds.
/// A step that would leave its piece ends on the face, and is put onto it exactly; there all pieces
/// that meet are asked. Where none promises a decrease, g_i = A_iᵀz_i with z_i ≥ 0 for each: the
/// certificate. Far from kinks a step may cross some where the cost keeps what was promised.
/// Conditions are met by multipliers: descents of L, each with better λ, until none is missed by
/// more than the tolerance; the certificate is then that of L, whose λ is the same on all pieces.
/// Throws std::invalid_argument like Unknowns.
TrajectoryOptimum OptimizeTrajectory(const MechanicalSystem& system,
                                     const TrajectoryProblem& problem,
                                     const TrajectoryOptions& options = {});

}  // namespace contact_flow
