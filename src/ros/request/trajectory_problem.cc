// SPDX-License-Identifier: BSD-3-Clause
#include "trajectory_problem.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "analysis_messages.h"
#include "contact_flow/RunCondition.h"
#include "request.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr double kLargestTolerance = 1e3, kLargestInterval = 1;
constexpr int kMaxIterations = 100000;
/// Unknowns beyond this many are refused: their second order is a full matrix.
constexpr int kMaxUnknowns = 1000;
constexpr std::size_t kMaxConditions = 1000;

/// [m] numbers by inputs, or none.
Vector OfInputs(const SystemDescription& names, const std::string& field,
                const std::vector<double>& values) {
  if (values.empty()) return Vector();
  CheckSize(field, values.size(), names.inputs.size(), names.inputs);
  CheckFinite(field, values);
  return FromMsg(values);
}

/// Goals by names, with weights that are 1 where they are left out.
struct Goals {
  Vector target, weight;
};

Goals ResolveGoals(const SystemDescription& names, const std::string& field,
                   const std::vector<std::string>& asked, const std::string& targets_field,
                   const std::vector<double>& targets, const std::string& weights_field,
                   const std::vector<double>& weights, Eigen::Index size) {
  Goals goals{Vector::Zero(size), Vector::Zero(size)};
  CheckSize(targets_field, targets.size(), asked.size(), asked);
  CheckFinite(targets_field, targets);
  if (!weights.empty()) CheckSize(weights_field, weights.size(), asked.size(), asked);
  CheckWeights(weights_field, weights);
  for (std::size_t k = 0; k < asked.size(); ++k) {
    const std::string place = field + "[" + std::to_string(k) + "]";
    const int i = StateIndex(place, asked[k], names);
    if (i >= size) {
      throw std::invalid_argument(place + " is '" + asked[k] + "': a position is needed");
    }
    goals.target(i) = targets[k];
    goals.weight(i) = weights.empty() ? 1 : weights[k];
  }
  return goals;
}

/// Numbers that are all finite, `count` of them or none.
Vector OfChosen(const std::string& field, const std::vector<double>& values,
                const std::vector<std::string>& chosen) {
  if (values.empty()) return Vector();
  CheckSize(field, values.size(), chosen.size(), chosen);
  CheckFinite(field, values);
  return FromMsg(values);
}

void ResolveChosen(const Setup& setup, const TrajectoryRequest& request,
                   TrajectoryProblem* problem) {
  const MechanicalSystem& system = *setup.system;
  const SystemDescription& names = system.description();
  const int nq = system.num_positions();
  problem->choose_inputs = !request.keep_inputs;
  for (std::size_t k = 0; k < request.initial.size(); ++k) {
    const int i = StateIndex("initial[" + std::to_string(k) + "]", request.initial[k], names);
    problem->choose_initial.push_back(i < nq ? i : i - nq + system.dof());
  }
  problem->choose_parameters = ParameterIndices(names, request.parameters);
  problem->parameter_lower =
      OfChosen("parameter_lower", request.parameter_lower, request.parameters);
  problem->parameter_upper =
      OfChosen("parameter_upper", request.parameter_upper, request.parameters);
  problem->factory = [&setup, &names](const ParameterValues& values) {
    ParameterValues all;
    for (const Parameter& parameter : names.parameters) all[parameter.name] = parameter.value;
    for (const auto& value : values) all[value.first] = value.second;
    return setup.WithParameters(all);
  };
  std::vector<std::string> intervals;
  for (std::uint32_t interval : request.durations) {
    if (interval >= problem->inputs.grid.size()) {
      throw std::invalid_argument("durations has " + std::to_string(interval) + ": the grid has " +
                                  std::to_string(problem->inputs.grid.size()) + " intervals");
    }
    problem->choose_durations.push_back(static_cast<int>(interval));
    intervals.push_back(std::to_string(interval));
  }
  problem->keep_horizon = request.keep_horizon;
  problem->duration_lower = OfChosen("duration_lower", request.duration_lower, intervals);
  problem->duration_upper = OfChosen("duration_upper", request.duration_upper, intervals);
}

void ResolveConditions(const MechanicalSystem& system, const TrajectoryRequest& request,
                       TrajectoryProblem* problem) {
  const SystemDescription& names = system.description();
  const int count = static_cast<int>(problem->inputs.grid.size());
  for (std::size_t k = 0; k < request.conditions.size(); ++k) {
    const RunCondition& asked = request.conditions[k];
    const std::string field = "conditions[" + std::to_string(k) + "]";
    TrajectoryCondition condition;
    condition.lower = asked.lower;
    condition.upper = asked.upper;
    if (!(asked.lower <= asked.upper)) {
      throw std::invalid_argument(field + ": the lower bound is above the upper");
    }
    if (asked.touchdown) {
      if (asked.every_instant) {
        throw std::invalid_argument(field + ": every_instant is none of a touchdown");
      }
      condition.kind = TrajectoryCondition::Kind::kTouchdown;
      condition.index = NameIndex(field + ".name", "constraint", asked.name, names.constraints);
      condition.number = ResolveCount(field + ".number", asked.number, 1, kMaxIterations) - 1;
      problem->conditions.push_back(condition);
      continue;
    }
    condition.index = StateIndex(field + ".name", asked.name, names);
    const int number = ResolveCount(field + ".number", asked.number, count, count);
    for (int i = asked.every_instant ? 1 : number; i <= (asked.every_instant ? count : number);
         ++i) {
      condition.number = i;
      problem->conditions.push_back(condition);
    }
  }
  if (problem->conditions.size() > kMaxConditions) {
    throw std::invalid_argument(std::to_string(problem->conditions.size()) +
                                " conditions, each instant counted: at most " +
                                std::to_string(kMaxConditions) + " can be");
  }
  problem->condition_tolerance = ResolveNumber("condition_tolerance", request.condition_tolerance,
                                               problem->condition_tolerance, kLargestTolerance);
}

void ResolvePath(const MechanicalSystem& system, const TrajectoryRequest& request,
                 TrajectoryProblem* problem) {
  const int nq = system.num_positions();
  const RowMajorMatrix& reference = request.path_reference;
  const bool along = reference.rows > 0 || reference.cols > 0 || !reference.data.empty();
  const std::vector<double> none(along ? request.path.size() : 0, 0.0);
  if (along && !request.path_targets.empty()) {
    throw std::invalid_argument("path_targets and path_reference are both given");
  }
  const Goals path =
      ResolveGoals(system.description(), "path", request.path, "path_targets",
                   along ? none : request.path_targets, "path_weights", request.path_weights, nq);
  problem->path_target = path.target;
  problem->path_weight = path.weight;
  if (!along) return;
  const std::size_t count = problem->inputs.grid.size(), cols = request.path.size();
  if (reference.rows != count || reference.cols != cols || reference.data.size() != count * cols) {
    throw std::invalid_argument("path_reference is " + std::to_string(reference.rows) + " × " +
                                std::to_string(reference.cols) + ": " + std::to_string(count) +
                                " × " + std::to_string(cols) + " is needed");
  }
  CheckFinite("path_reference.data", reference.data);
  problem->path_reference = Matrix::Zero(nq, static_cast<Eigen::Index>(count));
  for (std::size_t i = 0; i < cols; ++i) {
    const int place = StateIndex("path", request.path[i], system.description());
    for (std::size_t k = 0; k < count; ++k) {
      problem->path_reference(place, static_cast<Eigen::Index>(k)) = reference.data[k * cols + i];
    }
  }
}

/// Numbers of places by their names, 0 elsewhere; none without names.
Vector ResolveWeights(const std::string& field, const std::string& kind,
                      const std::vector<std::string>& asked, const std::string& weights_field,
                      const std::vector<double>& weights, const std::vector<std::string>& names) {
  if (!weights.empty()) CheckSize(weights_field, weights.size(), asked.size(), asked);
  CheckWeights(weights_field, weights);
  if (asked.empty()) return Vector();
  Vector by_place = Vector::Zero(static_cast<Eigen::Index>(names.size()));
  for (std::size_t k = 0; k < asked.size(); ++k) {
    const std::string place = field + "[" + std::to_string(k) + "]";
    const int i = NameIndex(place, kind, asked[k], names);
    if (std::find(asked.begin(), asked.begin() + static_cast<long>(k), asked[k]) !=
        asked.begin() + static_cast<long>(k)) {
      throw std::invalid_argument(place + " is '" + asked[k] + "' for the second time");
    }
    by_place(i) = weights.empty() ? 1 : weights[k];
  }
  return by_place;
}

void ResolveNamedCosts(const SystemDescription& names, const TrajectoryRequest& request,
                       TrajectoryProblem* problem) {
  const std::vector<std::string>& inputs = request.power_inputs;
  CheckSize("power_velocities", request.power_velocities.size(), inputs.size(), inputs);
  if (!request.power_weights.empty()) {
    CheckSize("power_weights", request.power_weights.size(), inputs.size(), inputs);
  }
  CheckWeights("power_weights", request.power_weights);
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    const std::string place = "[" + std::to_string(k) + "]";
    PowerTerm term;
    term.input = NameIndex("power_inputs" + place, "input", inputs[k], names.inputs);
    term.velocity = NameIndex("power_velocities" + place, "velocity", request.power_velocities[k],
                              names.velocities);
    term.weight = request.power_weights.empty() ? 1 : request.power_weights[k];
    problem->power.push_back(term);
  }
  problem->impulse_weight =
      ResolveWeights("impulses", "constraint", request.impulses, "impulse_weights",
                     request.impulse_weights, names.constraints);
  problem->slip_weight = ResolveWeights("slips", "constraint", request.slips, "slip_weights",
                                        request.slip_weights, names.constraints);
}

}  // namespace

TrajectoryProblem ResolveProblem(const Setup& setup, const TrajectoryRequest& request) {
  const MechanicalSystem& system = *setup.system;
  const SystemDescription& names = system.description();
  const ResolvedRun run =
      ResolveRun(setup, request.duration, request.state, request.input, request.input_grid, {});
  TrajectoryProblem problem;
  const double apart = problem.simulate.simultaneity_tolerance;
  problem.simulate = ResolveOptions(TightOptions(setup), request.options);
  if (request.options.simultaneity_tolerance == 0) problem.simulate.simultaneity_tolerance = apart;
  problem.derivative = ResolveOptions(TightDerivativeOptions(setup), request.derivative_options);
  problem.x = run.x;
  problem.inputs = run.input;
  problem.duration = run.duration;
  ResolveChosen(setup, request, &problem);
  problem.effort = Vector::Zero(system.num_inputs());
  CheckWeights("effort", request.effort);
  const Vector effort = OfInputs(names, "effort", request.effort);
  if (effort.size() > 0) problem.effort = effort;
  problem.input_reference = OfInputs(names, "reference", request.reference);
  problem.lower = OfInputs(names, "lower", request.lower);
  problem.upper = OfInputs(names, "upper", request.upper);
  const Goals end = ResolveGoals(names, "outcomes", request.outcomes, "targets", request.targets,
                                 "weights", request.weights, system.state_size());
  problem.target = end.target;
  problem.weight = end.weight;
  ResolvePath(system, request, &problem);
  CheckWeights("duration_weight", std::vector<double>{request.duration_weight});
  problem.duration_weight = request.duration_weight;
  ResolveNamedCosts(names, request, &problem);
  problem.linear_inputs = request.linear_inputs;
  problem.input_end = OfInputs(names, "input_end", request.input_end);
  ResolveConditions(system, request, &problem);
  problem.kink_interval = ResolveNumber("kink_interval", request.kink_interval,
                                        problem.kink_interval, kLargestInterval);
  const int unknowns = Unknowns(system, problem).size();
  if (unknowns > kMaxUnknowns) {
    throw std::invalid_argument(std::to_string(unknowns) + " numbers may be chosen: at most " +
                                std::to_string(kMaxUnknowns) + " can be");
  }
  return problem;
}

}  // namespace ros_interface
}  // namespace contact_flow
