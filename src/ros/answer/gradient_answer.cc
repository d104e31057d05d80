// SPDX-License-Identifier: BSD-3-Clause
#include "gradient_answer.h"

#include <stdexcept>
#include <string>

#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/derivative/start_directions.h"
#include "contact_flow/flow/simulate.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/analysis_messages.h"
#include "src/ros/request/request.h"
#include "src/session/directions.h"

namespace contact_flow {
namespace ros_interface {
namespace {

/// Weights and targets of named outcomes as vectors [nq+d].
void ResolveOutcomes(const MechanicalSystem& system, const std::string& prefix,
                     const std::vector<std::string>& outcomes, const std::vector<double>& targets,
                     const std::vector<double>& weights, Vector* weight, Vector* target) {
  if (!targets.empty()) {
    CheckSize(prefix + "targets", targets.size(), outcomes.size(), outcomes);
    CheckFinite(prefix + "targets", targets);
  }
  if (!weights.empty()) {
    CheckSize(prefix + "weights", weights.size(), outcomes.size(), outcomes);
    CheckWeights(prefix + "weights", weights);
  }
  *weight = *target = Vector::Zero(system.state_size());
  for (std::size_t k = 0; k < outcomes.size(); ++k) {
    const int i = StateIndex(prefix + "outcomes[" + std::to_string(k) + "]", outcomes[k],
                             system.description());
    (*weight)(i) = weights.empty() ? 1 : weights[k];
    (*target)(i) = targets.empty() ? 0 : targets[k];
  }
}

Vector ResolveInputs(const SystemDescription& names, const std::string& field,
                     const std::vector<double>& numbers) {
  if (numbers.empty()) return {};
  CheckSize(field, numbers.size(), names.inputs.size(), names.inputs);
  CheckFinite(field, numbers);
  return Eigen::Map<const Vector>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

RunCost ResolveCost(const MechanicalSystem& system, const GradientRequest& request) {
  QuadraticCost cost;
  ResolveOutcomes(system, "", request.outcomes, request.targets, request.weights, &cost.weight,
                  &cost.target);
  ResolveOutcomes(system, "path_", request.path_outcomes, request.path_targets,
                  request.path_weights, &cost.state_weight, &cost.state_reference);
  CheckWeights("effort", request.effort);
  cost.input_weight = ResolveInputs(system.description(), "effort", request.effort);
  cost.input_reference =
      ResolveInputs(system.description(), "effort_reference", request.effort_reference);
  RunCost made = cost.Make(system);
  if (made.terminal || made.running) return made;
  throw std::invalid_argument(
      "outcomes, path_outcomes and effort are empty, or their weights are 0: nothing costs "
      "anything");
}

/// Throws unless there are `size` numbers, or none.
Vector ResolvePart(const std::string& field, const std::vector<double>& numbers, int size) {
  if (numbers.empty()) return {};
  if (numbers.size() != static_cast<std::size_t>(size)) {
    throw std::invalid_argument(field + " has " + std::to_string(numbers.size()) +
                                " entries, expected " + std::to_string(size) + " or none");
  }
  CheckFinite(field, numbers);
  return Eigen::Map<const Vector>(numbers.data(), size);
}

/// False where all of it is left out.
bool ResolveDirection(const Setup& setup, const GradientRequest& request, const ResolvedRun& run,
                      const Variables& variables, RunDirection* direction) {
  const MechanicalSystem& system = *setup.system;
  direction->initial = ResolvePart("direction", request.direction, 2 * system.dof());
  direction->parameters = ResolvePart("direction_parameters", request.direction_parameters,
                                      static_cast<int>(variables.parameters.size()));
  if (!request.direction_inputs.data.empty()) {
    const Matrix rows = ToMatrix("direction_inputs", request.direction_inputs);
    const auto intervals = static_cast<Eigen::Index>(run.input.grid.size());
    if (rows.rows() != intervals || rows.cols() != system.num_inputs()) {
      throw std::invalid_argument(
          "direction_inputs is " + std::to_string(rows.rows()) + " × " +
          std::to_string(rows.cols()) + ", expected " + std::to_string(intervals) + " × " +
          std::to_string(system.num_inputs()) + ", a row for each interval");
    }
    direction->inputs = rows.transpose();
  }
  return direction->initial.size() + direction->inputs.size() + direction->parameters.size() > 0;
}

}  // namespace

GradientResult Answer(const Setup& setup, const GradientRequest& request) {
  CheckMessage(request);
  const MechanicalSystem& system = *setup.system;
  const SystemDescription& names = system.description();
  const ResolvedRun run = ResolveRun(setup, request);
  BDerivativeOptions options = ResolveOptions(setup.derivative_options, request.derivative_options);
  options.variables = ResolveVariables(setup, true, request.by_parameters);
  const RunCost cost = ResolveCost(system, request);
  RunDirection direction;
  const bool along = ResolveDirection(setup, request, run, options.variables, &direction);
  const ContactMode mode = InitialMode(system, run.x, run.input.values.front(), run.options);
  const StartDirections starts(system, run.x, mode, StartCone(), options.variables);
  // As by b_derivative: a direction that leaves the contact mode of the start is none.
  const StartDirections::Judgement judgement =
      starts.Judge(direction.AtStart(system, options.variables));
  if (!judgement.ok()) throw std::invalid_argument("direction " + starts.Sentence(judgement));

  const Trajectory trajectory = Simulate(system, run.x, run.input, run.duration, run.options);
  CostGradient J =
      DifferentiateCost(system, trajectory, cost, options, along ? &direction : nullptr);
  J.KeepStart(system, options.variables, starts);
  GradientResult result;
  result.model = names.name;
  result.velocities = names.velocities;
  result.inputs = names.inputs;
  result.parameters = request.by_parameters;
  result.outcome = static_cast<std::uint8_t>(J.status.outcome);
  result.message = J.status.message;
  WarnOfRun(trajectory, &result);
  if (!J.status.ok()) return result;
  result.cost = J.cost;
  result.by_state = ToMsg(VectorRef(J.initial));
  result.by_inputs = ToMsg(MatrixRef(Matrix(J.inputs.transpose())));
  result.by_parameters = ToMsg(VectorRef(J.parameters));
  result.by_instants = ToMsg(VectorRef(J.instants));
  result.by_duration = J.horizon;
  result.whole = J.whole;
  result.along = along ? J.Along(direction) : 0;
  for (const ContactMode& passed : J.modes) {
    result.mode_sequence.push_back(passed.ToString(names.constraints));
  }
  result.law = J.law;
  result.flow_law = J.flow_law;
  result.event_law = J.event_law;
  result.cost_error = J.cost_error;
  result.neglected_jump = J.neglected_jump;
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
