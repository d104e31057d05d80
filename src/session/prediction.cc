// SPDX-License-Identifier: BSD-3-Clause
#include "prediction.h"

#include <utility>

#include "contact_flow/flow/manifold_projection.h"
#include "notes.h"
#include "number_checks.h"

namespace contact_flow {
namespace {

constexpr double kShortestHorizon = 1e-9, kLongestHorizon = 1000;  // [s]
constexpr double kLargestSize = 1000;
constexpr double kUsualSize = 0.01;

void AddEvents(const SystemDescription& names, const Trajectory& run, Prediction* prediction) {
  for (const Arc& arc : run.arcs) {
    prediction->modes.push_back(arc.mode.ToString(names.constraints));
    prediction->mode_words.push_back(arc.mode.Word(static_cast<int>(names.constraints.size())));
  }
  for (const Transition& transition : run.transitions) {
    const ConstraintSet involved = transition.activated | transition.released | transition.switched;
    prediction->event_names.push_back(involved.ToString(names.constraints));
    prediction->event_times.push_back(transition.t);
  }
}

}  // namespace

Snapshot TakeSnapshot(std::shared_ptr<const Setup> setup, OnlineFlow* flow,
                      const AskedPrediction& asked) {
  CheckWithin("horizon", asked.horizon, kShortestHorizon, kLongestHorizon);
  CheckWithin("size", asked.size, 0, kLargestSize);
  Snapshot snapshot;
  ResolvedRun& run = snapshot.run;
  run.x = flow->State();
  ProjectContacts(*setup->system, flow->mode(), &run.x);
  run.input = {{flow->now()}, {flow->NextInput()}};
  for (const OnlineFlow::Input& input : flow->inputs_to_come()) {
    if (!(input.t > flow->now())) continue;
    run.input.grid.push_back(input.t);
    run.input.values.push_back(input.u);
  }
  run.duration = asked.horizon;
  run.options = setup->options;
  snapshot.directions = ResolveDirections(*setup, run, asked.directions, {});
  snapshot.setup = std::move(setup);
  return snapshot;
}

Prediction Predict(const Snapshot& snapshot, const AskedPrediction& asked,
                   const std::function<bool()>& cancelled) {
  Prediction prediction;
  prediction.epoch = asked.epoch;
  prediction.index = asked.index;
  const Setup& setup = *snapshot.setup;
  const MechanicalSystem& system = *setup.system;
  const Eigen::Index nq = system.num_positions(), d = system.dof();
  const Directions& directions = snapshot.directions;
  const ResolvedRun& run = snapshot.run;
  SimulateOptions options = run.options;
  options.cancelled = cancelled;
  const Trajectory outcome = Simulate(system, run.x, run.input, run.duration, options);
  prediction.t_begin = outcome.t_begin();
  prediction.t_end = outcome.t_end();
  prediction.q = outcome.FinalState().head(nq);
  prediction.v = outcome.FinalState().tail(d);
  AddEvents(system.description(), outcome, &prediction);
  const BDerivative derivative = DifferentiateOutcome(system, outcome, setup.derivative_options);
  prediction.outcome = derivative.status.outcome;
  prediction.message = derivative.status.message;
  prediction.warnings = outcome.warnings;
  AddNote(SummaryOf(outcome.warnings), &prediction.message);
  if (!derivative.status.ok()) return prediction;
  prediction.notes = directions.notes;
  for (const DirectionNote& note : directions.notes) AddNote(note.message, &prediction.message);
  prediction.direction_names = directions.names;
  const auto count = static_cast<Eigen::Index>(directions.vectors.size());
  const double size = asked.size > 0 ? asked.size : kUsualSize;
  Matrix derivatives(count, 2 * d), fan(count, nq + d);
  for (Eigen::Index j = 0; j < count; ++j) {
    const Vector change = derivative(directions.vectors[static_cast<std::size_t>(j)]);
    derivatives.row(j) = change.transpose();
    fan.row(j) = system.Perturb(outcome.FinalState(), size * change).transpose();
  }
  if (!derivatives.allFinite() || !fan.allFinite()) {
    prediction.outcome = Outcome::kNonFinite;
    prediction.message = "the derivative, or the fan of this size, is not finite";
    prediction.direction_names.clear();
    return prediction;
  }
  prediction.derivatives = derivatives;
  prediction.fan = fan;
  prediction.time_derivative = derivative.time;
  return prediction;
}

}  // namespace contact_flow
