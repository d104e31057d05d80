// SPDX-License-Identifier: BSD-3-Clause
#include "prediction.h"

#include <stdexcept>
#include <utility>

#include "contact_flow/flow/manifold_projection.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/directions.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr double kShortestHorizon = 1e-9, kLongestHorizon = 1000;  // [s]
constexpr double kLargestSize = 1000;
constexpr double kUsualSize = 0.01;

void AddEvents(const SystemDescription& names, const Trajectory& run,
               OutcomePrediction* prediction) {
  for (const Arc& arc : run.arcs) {
    prediction->mode_sequence.push_back(arc.mode.ToString(names.constraints));
    prediction->mode_words.push_back(ToWord(names.constraints, arc.mode));
  }
  for (const Transition& transition : run.transitions) {
    const ConstraintSet involved = transition.activated | transition.released | transition.switched;
    prediction->event_names.push_back(involved.ToString(names.constraints));
    prediction->event_times.push_back(transition.t);
  }
}

}  // namespace

Snapshot TakeSnapshot(std::shared_ptr<const Setup> setup, OnlineFlow* flow,
                      const PredictionRequest& request) {
  CheckMessage(request);
  CheckWithin("horizon", request.horizon, kShortestHorizon, kLongestHorizon);
  CheckWithin("size", request.size, 0, kLargestSize);
  Snapshot snapshot;
  Run& run = snapshot.run;
  run.x = flow->State();
  ProjectContacts(*setup->system, flow->mode(), &run.x);
  run.input = {{flow->now()}, {flow->NextInput()}};
  for (const OnlineFlow::Input& input : flow->inputs_to_come()) {
    if (!(input.t > flow->now())) continue;
    run.input.grid.push_back(input.t);
    run.input.values.push_back(input.u);
  }
  run.duration = request.horizon;
  run.options = setup->options;
  snapshot.directions = ResolveDirections(*setup, run, request.directions, request.direction_matrix,
                                          request.project_directions, {});
  snapshot.setup = std::move(setup);
  return snapshot;
}

OutcomePrediction Predict(const Snapshot& snapshot, const PredictionRequest& request,
                          const std::function<bool()>& cancelled) {
  OutcomePrediction prediction;
  prediction.epoch = request.epoch;
  prediction.index = request.index;
  const Setup& setup = *snapshot.setup;
  const MechanicalSystem& system = *setup.system;
  const Eigen::Index nq = system.num_positions(), d = system.dof();
  const Directions& directions = snapshot.directions;
  const Run& run = snapshot.run;
  SimulateOptions options = run.options;
  options.cancelled = cancelled;
  const Trajectory outcome = Simulate(system, run.x, run.input, run.duration, options);
  prediction.t_begin = outcome.t_begin();
  prediction.t_end = outcome.t_end();
  prediction.q = ToMsg(VectorRef(outcome.FinalState().head(nq)));
  prediction.v = ToMsg(VectorRef(outcome.FinalState().tail(d)));
  AddEvents(system.description(), outcome, &prediction);
  const BDerivative derivative = DifferentiateOutcome(system, outcome, setup.derivative_options);
  prediction.outcome = static_cast<std::uint8_t>(derivative.status.outcome);
  prediction.message = derivative.status.message;
  WarnOfRun(outcome, &prediction);
  if (!derivative.status.ok()) return prediction;
  for (const ResultWarning& warning : directions.warnings) Warn(warning, &prediction);
  prediction.direction_names = directions.names;
  const auto count = static_cast<Eigen::Index>(directions.vectors.size());
  const double size = request.size > 0 ? request.size : kUsualSize;
  Matrix derivatives(count, 2 * d), fan(count, nq + d);
  for (Eigen::Index j = 0; j < count; ++j) {
    const Vector change = derivative(directions.vectors[static_cast<std::size_t>(j)]);
    derivatives.row(j) = change.transpose();
    fan.row(j) = system.Perturb(outcome.FinalState(), size * change).transpose();
  }
  if (!derivatives.allFinite() || !fan.allFinite()) {
    prediction.outcome = static_cast<std::uint8_t>(Outcome::kNonFinite);
    prediction.message = "the derivative, or the fan of this size, is not finite";
    prediction.direction_names.clear();
    return prediction;
  }
  prediction.derivatives = ToMsg(MatrixRef(derivatives));
  prediction.fan = ToMsg(MatrixRef(fan));
  prediction.time_derivative = ToMsg(VectorRef(derivative.time));
  return prediction;
}

}  // namespace ros_interface
}  // namespace contact_flow
