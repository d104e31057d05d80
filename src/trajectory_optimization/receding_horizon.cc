// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/receding_horizon.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "contact_flow/budget.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "rollout.h"
#include "window.h"

namespace contact_flow {
namespace {

/// Part of the budget that the search may take.
constexpr double kSearchPart = 0.75;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

using Clock = std::chrono::steady_clock;

double Since(Clock::time_point begun) {
  return std::chrono::duration<double>(Clock::now() - begun).count();
}

/// What a thread may take until `seconds` after `begun`.
Budget BudgetUntil(Clock::time_point begun, double seconds, const HorizonOptions& options) {
  BudgetLimits limits;
  limits.max_seconds = std::max(0.0, seconds - Since(begun));
  limits.cancelled = options.cancelled;
  limits.look_every = std::min(limits.look_every, 0.05 * options.budget);
  return Budget(limits);
}

void CheckTask(const MechanicalSystem& system, const HorizonOptions& options,
               const HorizonTask& task) {
  RequireHorizon(options.budget > 0, "budget must be > 0");
  RequireHorizon(options.max_iterations >= 0 && options.tolerance >= 0,
                 "max_iterations and tolerance must be ≥ 0");
  RequireHorizon(options.period > 0, "period must be > 0");
  RequireHorizon(task.policy != nullptr, "there is no policy");
  RequireHorizon(task.begin >= task.t && std::isfinite(task.begin - task.t),
                 "a solution cannot begin before its task");
  RequireHorizon(task.x.size() == system.state_size(),
                 "x has " + std::to_string(task.x.size()) +
                     " entries: " + std::to_string(system.state_size()) + " are needed");
  RequireHorizon(task.changes.size() == static_cast<std::size_t>(system.num_constraints()),
                 "changes needs an entry for each constraint");
}

/// Instants at which inputs are set until `end`.
std::vector<double> Every(double period, double from, double end) {
  std::vector<double> times = {from};
  for (int k = 1; from + k * period < end - 0.5 * period; ++k) times.push_back(from + k * period);
  return times;
}

/// One solve, of which the caller keeps the time.
class WindowSolve {
 public:
  WindowSolve(const std::shared_ptr<const MechanicalSystem>& system, const HorizonProblem& problem,
              const HorizonOptions& options, const HorizonTask& task, Clock::time_point begun)
      : system_(system), problem_(problem), options_(options), task_(task), begun_(begun) {}

  void Go(HorizonSolution* result) {
    Window window = WindowAt(problem_, task_.begin);
    if (window.problem.inputs.grid.empty()) {
      result->message = "the whole is over by then";
      return;
    }
    PolicyTracker tracker = task_.tracker;
    if (!Predict(&tracker, result)) return;
    window.problem.x = result->x;
    Warm(tracker, &window, result);
    const TrajectoryOptimum found = Search(window, result);
    if (result->verdict != HorizonVerdict::kSolved &&
        result->verdict != HorizonVerdict::kUnfinished) {
      return;
    }
    window.problem.inputs = found.inputs;
    result->policy =
        std::make_shared<const TrackingPolicy>(Policy(*system_, window.problem, options_));
  }

  static TrackingPolicy Policy(const MechanicalSystem& system, const TrajectoryProblem& problem,
                               const HorizonOptions& options) {
    SimulateOptions dense = problem.simulate;
    dense.dense = true;
    const Trajectory run = Simulate(system, problem.x, problem.inputs, problem.duration, dense);
    const Unknowns unknowns(system, problem);
    TrackingPolicy policy =
        MakePolicy(system, run, problem.inputs, options.reach, options.weights, problem.derivative,
                   unknowns.ConesOfInputs(unknowns.Start()));
    policy.lower = problem.lower;
    policy.upper = problem.upper;
    return policy;
  }

 private:
  /// Until the solution begins, under the policy that is followed.
  bool Predict(PolicyTracker* tracker, HorizonSolution* result) const {
    result->x = task_.x;
    result->changes = task_.changes;
    const TrajectoryProblem& whole = problem_.whole;
    const Rollout way = RollOut(system_, tracker, Every(options_.period, task_.t, task_.begin),
                                task_.begin, task_.x, whole.simulate);
    if (!way.status.ok()) {
      result->message = "the motion until it begins ends early: " + way.status.message;
      return false;
    }
    result->x = way.x;
    result->mode = way.mode;
    for (std::size_t i = 0; i < way.changes.size(); ++i) result->changes[i] += way.changes[i];
    return true;
  }

  /// The inputs that the search begins with.
  void Warm(PolicyTracker tracker, Window* window, HorizonSolution* result) const {
    InputSchedule& inputs = window->problem.inputs;
    const ExtendedReference& last = task_.policy->reference;
    const double end = last.phases().back().t_end;
    for (std::size_t k = 0; k < inputs.grid.size(); ++k) {
      if (inputs.grid[k] < end) inputs.values[k] = last.Input(inputs.grid[k]);
    }
    result->first_cost = CostOf(window->problem);
    Rollout fed;
    try {
      fed = RollOut(system_, &tracker, inputs.grid, window->end, window->problem.x,
                    window->problem.simulate);
    } catch (const std::invalid_argument&) {
      return;
    }
    if (!fed.status.ok()) return;
    // Beyond its end the policy says nothing.
    for (std::size_t k = 0; k < inputs.grid.size(); ++k) {
      if (!(inputs.grid[k] < end)) fed.inputs.values[k] = inputs.values[k];
    }
    TrajectoryProblem other = window->problem;
    other.inputs = fed.inputs;
    if (!(CostOf(other) >= result->first_cost)) inputs = fed.inputs;
  }

  /// J of the problem's own inputs; NaN where their run ends early.
  double CostOf(const TrajectoryProblem& problem) const {
    const Unknowns unknowns(*system_, problem);
    const Vector y = unknowns.Start();
    const Trajectory run = unknowns.Run(y, problem.simulate.simultaneity_tolerance, true);
    if (run.status.outcome == Outcome::kBudgetExceeded) AskBudget();
    return run.status.ok() ? unknowns.Cost(y, run) : kNaN;
  }

  TrajectoryOptimum Search(const Window& window, HorizonSolution* result) const {
    const BudgetScope scope(BudgetUntil(begun_, kSearchPart * options_.budget, options_));
    TrajectoryOptions options;
    options.max_iterations = options_.max_iterations;
    options.tolerance = options_.tolerance;
    options.certify = false;
    TrajectoryOptimum found = OptimizeTrajectory(*system_, window.problem, options);
    result->message = found.message;
    result->cost = found.cost;
    result->iterations = std::max(0, static_cast<int>(found.iterations.size()) - 1);
    switch (found.verdict) {
      case TrajectoryVerdict::kSmoothMinimum:
      case TrajectoryVerdict::kValley:
        result->verdict = HorizonVerdict::kSolved;
        break;
      case TrajectoryVerdict::kStalled:
      case TrajectoryVerdict::kMaxIterations:
        result->verdict = HorizonVerdict::kUnfinished;
        break;
      case TrajectoryVerdict::kCancelled:
        result->verdict =
            found.iterations.empty() ? HorizonVerdict::kLate : HorizonVerdict::kUnfinished;
        break;
      case TrajectoryVerdict::kUndefined:
      case TrajectoryVerdict::kInfeasible:
        result->verdict = HorizonVerdict::kFailed;
    }
    return found;
  }

  const std::shared_ptr<const MechanicalSystem>& system_;
  const HorizonProblem& problem_;
  const HorizonOptions& options_;
  const HorizonTask& task_;
  const Clock::time_point begun_;
};

std::string Told(const HorizonSolution& solution, const HorizonOptions& options) {
  std::ostringstream text;
  text.precision(4);
  text << VerdictName(solution.verdict) << " in " << 1e3 * solution.seconds << " ms";
  if (solution.verdict == HorizonVerdict::kLate && std::isfinite(options.budget)) {
    text << " of " << 1e3 * options.budget << " ms";
  }
  if (solution.policy == nullptr) text << ", the last policy is kept";
  if (!solution.message.empty()) text << ": " << solution.message;
  return text.str();
}

}  // namespace

HorizonSolution SolveHorizon(const std::shared_ptr<const MechanicalSystem>& system,
                             const HorizonProblem& problem, const HorizonOptions& options,
                             const HorizonTask& task) {
  const Clock::time_point begun = Clock::now();
  CheckHorizon(*system, problem);
  CheckTask(*system, options, task);
  HorizonSolution result;
  result.t = task.t;
  result.begin = task.begin;
  result.first_cost = result.cost = kNaN;
  try {
    const BudgetScope scope(BudgetUntil(begun, options.budget, options));
    WindowSolve(system, problem, options, task, begun).Go(&result);
  } catch (const BudgetExceeded& reason) {
    result.verdict = HorizonVerdict::kLate;
    result.message = reason.what();
  } catch (const std::logic_error& reason) {  // of the state, and NoPolicy
    result.verdict = HorizonVerdict::kFailed;
    result.message = reason.what();
  }
  result.seconds = Since(begun);
  if (result.seconds > options.budget && result.verdict != HorizonVerdict::kFailed) {
    result.verdict = HorizonVerdict::kLate;
    result.policy.reset();
  }
  result.message = Told(result, options);
  return result;
}

TrackingPolicy FirstPolicy(const MechanicalSystem& system, const HorizonProblem& problem,
                           const HorizonOptions& options) {
  CheckHorizon(system, problem);
  return WindowSolve::Policy(system, problem.whole, options);
}

HorizonProblem FollowReference(const TrackingPolicy& policy, const Vector& effort,
                               const Vector& path_weight, const Vector& weight, int intervals) {
  const ExtendedReference& reference = policy.reference;
  const InputSchedule& inputs = reference.inputs();
  const auto count = static_cast<Eigen::Index>(inputs.grid.size());
  const double end = reference.phases().back().t_end;
  HorizonProblem problem;
  problem.intervals = intervals;
  TrajectoryProblem& whole = problem.whole;
  whole.x = reference.phases().front().x_begin;
  whole.inputs = inputs;
  whole.duration = end - inputs.grid.front();
  whole.effort = effort;
  whole.path_weight = path_weight;
  whole.weight = weight;
  whole.lower = policy.lower;
  whole.upper = policy.upper;
  whole.input_path.resize(inputs.values.front().size(), count);
  problem.goals.resize(whole.x.size(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto next = static_cast<std::size_t>(k) + 1;
    const double t = k + 1 < count ? inputs.grid[next] : end;
    whole.input_path.col(k) = inputs.values[static_cast<std::size_t>(k)];
    problem.goals.col(k) = reference.State(reference.PhaseAt(t), t);
  }
  whole.target = problem.goals.rightCols<1>();
  whole.path_reference = problem.goals.topRows(reference.space().num_positions());
  whole.simulate.relative_tolerance = whole.simulate.absolute_tolerance = 1e-9;
  whole.derivative.tolerance = 1e-8;
  return problem;
}

const char* VerdictName(HorizonVerdict verdict) {
  constexpr const char* kNames[] = {"solved", "unfinished", "late", "failed"};
  return kNames[static_cast<int>(verdict)];
}

}  // namespace contact_flow
