// SPDX-License-Identifier: BSD-3-Clause
#include "optimization_answer.h"

#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/OptimizeOutcomeResult.h"
#include "contact_flow/analysis/outcome_cost.h"
#include "contact_flow/piecewise_linear/descent.h"
#include "limits.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/analysis_messages.h"
#include "src/ros/request/request.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using OptimizationCodes = OptimizeOutcomeResult;

static_assert(OptimizationCodes::MINIMUM == static_cast<int>(DescentStatus::kMinimum) &&
                  OptimizationCodes::STALLED == static_cast<int>(DescentStatus::kStalled) &&
                  OptimizationCodes::UNDEFINED == static_cast<int>(DescentStatus::kUndefined) &&
                  OptimizationCodes::MAX_ITERATIONS ==
                      static_cast<int>(DescentStatus::kMaxIterations) &&
                  OptimizationCodes::CANCELLED == static_cast<int>(DescentStatus::kCancelled),
              "the constants of the action are the statuses");

constexpr double kLargestRadius = 1e6;
const char kInput[] = "input ";

OutcomeUnknown ResolveUnknown(const MechanicalSystem& system, const std::string& field,
                              const std::string& name) {
  const SystemDescription& names = system.description();
  if (name.compare(0, sizeof(kInput) - 1, kInput) == 0) {
    return {OutcomeUnknown::Kind::kInput,
            NameIndex(field, "input", name.substr(sizeof(kInput) - 1), names.inputs)};
  }
  const int i = StateIndex(field, name, names), nq = system.num_positions();
  return i < nq ? OutcomeUnknown{OutcomeUnknown::Kind::kPosition, i}
                : OutcomeUnknown{OutcomeUnknown::Kind::kVelocity, i - nq};
}

OutcomeProblem ResolveOutcomeProblem(const Setup& setup, const OptimizationRequest& request) {
  const MechanicalSystem& system = *setup.system;
  const SystemDescription& names = system.description();
  const ResolvedRun run = ResolveRun(setup, request.duration, request.state, request.input, {}, {});
  OutcomeProblem problem;
  const double apart = problem.simulate.simultaneity_tolerance;
  problem.simulate = ResolveOptions(TightOptions(setup), request.options);
  if (request.options.simultaneity_tolerance == 0) problem.simulate.simultaneity_tolerance = apart;
  problem.derivative = ResolveOptions(TightDerivativeOptions(setup), request.derivative_options);
  problem.x = run.x;
  problem.u = run.input.values.front();
  problem.duration = run.duration;
  if (request.unknowns.empty())
    throw std::invalid_argument("unknowns is empty: nothing may be chosen");
  for (std::size_t k = 0; k < request.unknowns.size(); ++k) {
    problem.unknowns.push_back(
        ResolveUnknown(system, "unknowns[" + std::to_string(k) + "]", request.unknowns[k]));
  }
  problem.target = problem.weight = Vector::Zero(system.state_size());
  problem.effort = Vector::Zero(system.num_inputs());
  CheckSize("targets", request.targets.size(), request.outcomes.size(), request.outcomes);
  CheckFinite("targets", request.targets);
  if (!request.weights.empty()) {
    CheckSize("weights", request.weights.size(), request.outcomes.size(), request.outcomes);
  }
  CheckWeights("weights", request.weights);
  for (std::size_t k = 0; k < request.outcomes.size(); ++k) {
    const int i = StateIndex("outcomes[" + std::to_string(k) + "]", request.outcomes[k], names);
    problem.target(i) = request.targets[k];
    problem.weight(i) = request.weights.empty() ? 1 : request.weights[k];
  }
  if (!request.effort.empty()) {
    CheckSize("effort", request.effort.size(), names.inputs.size(), names.inputs);
    CheckWeights("effort", request.effort);
    problem.effort = Eigen::Map<const Vector>(request.effort.data(), problem.effort.size());
  }
  return problem;
}

const char* MethodName(DescentMethod method) {
  constexpr const char* kNames[] = {"", "trust region", "BFGS"};
  return kNames[static_cast<int>(method)];
}

}  // namespace

OptimizationResult Answer(const Setup& setup, const OptimizationRequest& request,
                          const Watch& watch) {
  CheckMessage(request);
  const MechanicalSystem& system = *setup.system;
  OutcomeProblem problem = ResolveOutcomeProblem(setup, request);
  DescentOptions options;
  options.tolerance =
      ResolveNumber("tolerance", request.tolerance, options.tolerance, kLargestTolerance);
  options.radius = ResolveNumber("radius", request.radius, options.radius, kLargestRadius);
  options.max_iterations = ResolveCount("max_iterations", request.max_iterations,
                                        options.max_iterations, kMaxIterations);
  const auto cancelled = [&] {
    return watch.Cancelled() || (setup.options.cancelled && setup.options.cancelled());
  };
  problem.simulate.cancelled = cancelled;
  options.progress = [&](const DescentIteration& iteration, const Vector& best) {
    if (watch.report) {
      watch.report(iteration.iteration,
                   static_cast<double>(iteration.iteration) / options.max_iterations,
                   iteration.cost, best);
    }
    return !cancelled();
  };
  const DescentResult found =
      Minimize(MakeOutcomeCost(system, problem), UnknownValues(system, problem), options);
  OptimizationResult result;
  result.model = system.description().name;
  result.outcome = cancelled() ? kAnalysisCancelled
                   : found.status == DescentStatus::kCancelled
                       ? EndOfSearch()
                       : static_cast<std::uint8_t>(found.status);
  result.message = found.message;
  result.unknowns = request.unknowns;
  result.values = ToMsg(VectorRef(found.y));
  result.cost = found.cost;
  for (const DescentIteration& iteration : found.iterations) {
    SolverIteration m;
    m.iteration = static_cast<std::uint32_t>(iteration.iteration);
    m.value = iteration.cost;
    m.step = iteration.step;
    m.method = MethodName(iteration.method);
    result.iterations.push_back(m);
  }
  result.slope = found.steepest.slope;
  result.descent = ToMsg(VectorRef(found.steepest.d));
  for (const Kink& kink : found.kinks) {
    CostKink m;
    m.normal = ToMsg(VectorRef(kink.normal));
    m.jump = kink.jump;
    m.valley = kink.IsValley();
    result.kinks.push_back(m);
  }
  if (found.status == DescentStatus::kUndefined) return result;
  const OutcomeProblem best = WithUnknowns(system, problem, found.y);
  const Trajectory run = Simulate(system, best.x, best.u, best.duration, best.simulate);
  WarnOfRun(run, &result);
  result.final_q = ToMsg(VectorRef(run.FinalState().head(system.num_positions())));
  result.final_v = ToMsg(VectorRef(run.FinalState().tail(system.dof())));
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
