// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"

#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "certificate.h"
#include "contact_flow/budget.h"
#include "search.h"

namespace contact_flow {
namespace {

/// Stationary points that are no minima are left this often.
constexpr int kMaxEscapes = 20;

}  // namespace

Search::Search(const MechanicalSystem& system, const TrajectoryProblem& problem,
               const TrajectoryOptions& options)
    : unknowns_(system, problem), options_(options), tolerance_(options.tolerance) {}

TrajectoryOptimum Search::Go() {
  const BudgetStage stage("the search for a trajectory");
  best_.y = unknowns_.Start();
  try {
    FacePoint start = At(best_.y);
    if (!std::isfinite(start.cost)) {
      const bool misses = std::isfinite(start.plain);
      const std::string why = misses ? "" : ModelsAt(best_.y).status.message;
      End(TrajectoryVerdict::kUndefined,
          misses ? "a touchdown of the conditions does not happen in the run that it begins with"
                 : "the run that it begins with ends early" + (why.empty() ? "" : ": " + why));
    } else if (Take(start, 0, 0, KinkStatus::kNone)) {
      Solve(start);
      if (options_.neighbours) TryNeighbours();
      for (int i = 0; options_.certify && IsMinimum() && Escape(&start); ++i) {
        if (i == kMaxEscapes) {
          End(TrajectoryVerdict::kStalled,
              "the cost falls on along a flat bend: the second order promises more than the "
              "tolerance yet");
          break;
        }
        const double length = (start.y - best_.y).cwiseAbs().maxCoeff();
        if (!Take(start, length, 0, KinkStatus::kNone)) break;
        Solve(start);
        if (options_.neighbours) TryNeighbours();
      }
    }
  } catch (const BudgetExceeded& reason) {
    End(TrajectoryVerdict::kCancelled, reason.what());
  }
  Conclude();
  return std::move(result_);
}

void Search::Conclude() {
  result_.y = best_.y;
  result_.cost = best_.plain;
  result_.x = unknowns_.WithoutClock(unknowns_.InitialState(best_.y));
  result_.inputs = unknowns_.Inputs(best_.y);
  const std::size_t count = result_.inputs.grid.size();
  for (std::size_t k = 0; k < count; ++k) {
    result_.inputs.values[k] = unknowns_.InputAt(best_.y, k);
  }
  if (unknowns_.problem().linear_inputs) result_.input_end = unknowns_.InputAt(best_.y, count);
  result_.duration = unknowns_.Horizon(best_.y);
  const std::size_t parameters = unknowns_.problem().choose_parameters.size();
  result_.parameters.resize(static_cast<Eigen::Index>(parameters));
  for (std::size_t i = 0; i < parameters; ++i) {
    result_.parameters(static_cast<Eigen::Index>(i)) = best_.y(unknowns_.Parameter(i));
  }
  result_.condition_values = best_.values;
  if (best_.values.size() > 0 && multipliers_.rho.size() > 0) {
    Multipliers last = multipliers_;
    last.Update(unknowns_.problem().conditions, best_.values);
    result_.multipliers = last.lambda;
  }
  const bool minimum = IsMinimum();
  if (minimum && options_.certify) {
    try {
      Certify(unknowns_, ModelsAt(best_.y), best_.y, &result_);
    } catch (const BudgetExceeded& reason) {
      End(TrajectoryVerdict::kCancelled, reason.what());
    }
  }
  std::ostringstream message;
  message << VerdictName(result_.verdict);
  if (!result_.iterations.empty()) {
    message << " after " << result_.iterations.size() - 1 << " iterations, cost ";
    message.precision(10);
    message << best_.plain;
  }
  if (minimum && result_.certificate.size() > 1) {
    message << ", where " << result_.certificate.size() << " pieces meet";
  }
  if (!reason_.empty()) message << ": " << reason_;
  result_.message = message.str();
}

const char* VerdictName(TrajectoryVerdict verdict) {
  constexpr const char* kNames[] = {"smooth minimum", "valley",    "stalled",       "undefined",
                                    "max iterations", "cancelled", "out of budget", "infeasible"};
  return kNames[static_cast<int>(verdict)];
}

const char* KinkStatusName(KinkStatus status) {
  constexpr const char* kNames[] = {"none", "followed", "passed", "ridge", "neighbour"};
  return kNames[static_cast<int>(status)];
}

TrajectoryOptimum OptimizeTrajectory(const MechanicalSystem& system,
                                     const TrajectoryProblem& problem,
                                     const TrajectoryOptions& options) {
  if (!(options.tolerance >= 0) || options.max_iterations < 0) {
    throw std::invalid_argument("trajectory options: tolerance and max_iterations must be ≥ 0");
  }
  return Search(system, problem, options).Go();
}

}  // namespace contact_flow
