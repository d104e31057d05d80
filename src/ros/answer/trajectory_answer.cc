// SPDX-License-Identifier: BSD-3-Clause
#include "trajectory_answer.h"

#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/OptimizeTrajectoryResult.h"
#include "contact_flow/nearest_name.h"
#include "contact_flow/trajectory_optimization/multiple_shooting.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "limits.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/analysis_messages.h"
#include "src/ros/request/request.h"
#include "src/ros/request/trajectory_problem.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using TrajectoryCodes = OptimizeTrajectoryResult;

static_assert(TrajectoryCodes::SMOOTH_MINIMUM ==
                      static_cast<int>(TrajectoryVerdict::kSmoothMinimum) &&
                  TrajectoryCodes::VALLEY == static_cast<int>(TrajectoryVerdict::kValley) &&
                  TrajectoryCodes::STALLED == static_cast<int>(TrajectoryVerdict::kStalled) &&
                  TrajectoryCodes::UNDEFINED == static_cast<int>(TrajectoryVerdict::kUndefined) &&
                  TrajectoryCodes::MAX_ITERATIONS ==
                      static_cast<int>(TrajectoryVerdict::kMaxIterations) &&
                  TrajectoryCodes::CANCELLED == static_cast<int>(TrajectoryVerdict::kCancelled) &&
                  TrajectoryCodes::INFEASIBLE == static_cast<int>(TrajectoryVerdict::kInfeasible),
              "the constants of the action are the verdicts");

TrajectoryOptimum Search(const MechanicalSystem& system, const TrajectoryProblem& problem,
                         const TrajectoryOptions& options, const TrajectoryRequest& request) {
  const bool shoots = request.method == "multiple_shooting";
  if (!shoots && !request.method.empty() && request.method != "pieces") {
    throw std::invalid_argument("method is " + QuoteName(request.method) +
                                ", expected one of pieces, multiple_shooting");
  }
  if (!shoots) {
    if (!request.segments.empty()) {
      throw std::invalid_argument("segments are those of the method multiple_shooting");
    }
    return OptimizeTrajectory(system, problem, options);
  }
  if (request.neighbours) {
    throw std::invalid_argument("neighbours are tried by the method pieces alone");
  }
  ShootingOptions shooting;
  for (std::uint32_t instant : request.segments) {
    if (instant == 0 || instant >= problem.inputs.grid.size()) {
      throw std::invalid_argument("segments has " + std::to_string(instant) +
                                  ": the instants of the grid are 1 to " +
                                  std::to_string(problem.inputs.grid.size() - 1));
    }
    shooting.segments.push_back(static_cast<int>(instant));
  }
  if (request.tolerance > 0) shooting.tolerance = options.tolerance;
  return OptimizeByShooting(system, problem, options, shooting);
}

PieceCertificate ToCertificate(const contact_flow::PieceProof& piece) {
  PieceCertificate m;
  m.label = piece.label;
  for (const KinkSlope& slope : piece.slopes) {
    m.first.push_back(slope.first);
    m.second.push_back(slope.second);
    m.apart.push_back(slope.apart);
    m.slopes.push_back(slope.slope);
  }
  m.residual = piece.residual;
  m.decrease = piece.decrease;
  m.hull_weight = piece.hull_weight;
  return m;
}

InputGrid ToGrid(const InputSchedule& schedule, Eigen::Index inputs) {
  InputGrid m;
  m.times = schedule.grid;
  Matrix values(static_cast<Eigen::Index>(schedule.values.size()), inputs);
  for (std::size_t k = 0; k < schedule.values.size(); ++k) {
    values.row(static_cast<Eigen::Index>(k)) = schedule.values[k].transpose();
  }
  m.values = ToMsg(MatrixRef(values));
  return m;
}

}  // namespace

TrajectoryResult Answer(const Setup& setup, const TrajectoryRequest& request, const Watch& watch) {
  CheckMessage(request);
  const MechanicalSystem& system = *setup.system;
  TrajectoryProblem problem = ResolveProblem(setup, request);
  TrajectoryOptions options;
  options.tolerance =
      ResolveNumber("tolerance", request.tolerance, options.tolerance, kLargestTolerance);
  options.max_iterations = ResolveCount("max_iterations", request.max_iterations,
                                        options.max_iterations, kMaxIterations);
  options.neighbours = request.neighbours;
  const auto cancelled = [&] {
    return watch.Cancelled() || (setup.options.cancelled && setup.options.cancelled());
  };
  problem.simulate.cancelled = cancelled;
  options.progress = [&](const TrajectoryIteration& at, const Vector& y) {
    if (watch.report_step) watch.report_step(at);
    if (watch.report) {
      watch.report(at.iteration, static_cast<double>(at.iteration) / options.max_iterations,
                   at.cost, y);
    }
    return !cancelled();
  };
  const TrajectoryOptimum found = Search(system, problem, options, request);
  TrajectoryResult result;
  result.model = system.description().name;
  result.outcome = cancelled() ? kAnalysisCancelled
                   : found.verdict == TrajectoryVerdict::kCancelled
                       ? EndOfSearch()
                       : static_cast<std::uint8_t>(found.verdict);
  result.message = found.message;
  result.cost = found.cost;
  const int nq = system.num_positions(), d = system.dof();
  result.initial_q = ToMsg(VectorRef(found.x.head(nq)));
  result.initial_v = ToMsg(VectorRef(found.x.tail(d)));
  result.inputs = ToGrid(found.inputs, system.num_inputs());
  result.input_end = ToMsg(VectorRef(found.input_end));
  result.duration = found.duration;
  result.parameters = ToMsg(VectorRef(found.parameters));
  result.condition_values = ToMsg(VectorRef(found.condition_values));
  result.multipliers = ToMsg(VectorRef(found.multipliers));
  for (const contact_flow::PieceProof& piece : found.certificate) {
    result.pieces.push_back(ToCertificate(piece));
  }
  result.hull_distance = found.hull_distance;
  result.valleys = static_cast<std::uint32_t>(found.valleys);
  result.simulations = static_cast<std::uint64_t>(found.simulations);
  result.derivatives = static_cast<std::uint64_t>(found.derivatives);
  for (const TrajectoryIteration& at : found.iterations) {
    TrajectoryIterate m;
    m.iteration = static_cast<std::uint32_t>(at.iteration);
    m.cost = at.cost;
    m.best = at.best;
    m.violation = at.violation;
    m.step = at.step;
    m.pieces = static_cast<std::uint32_t>(at.pieces);
    m.kink = KinkStatusName(at.kink);
    result.iterations.push_back(m);
  }
  if (found.verdict == TrajectoryVerdict::kUndefined) return result;
  const Unknowns unknowns(system, problem);
  const Trajectory run =
      unknowns.Run(found.y, problem.simulate.simultaneity_tolerance, problem.simulate.dense);
  WarnOfRun(run, &result);
  const Vector end = unknowns.WithoutClock(run.FinalState());
  result.final_q = ToMsg(VectorRef(end.head(nq)));
  result.final_v = ToMsg(VectorRef(end.tail(d)));
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
