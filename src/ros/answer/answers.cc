// SPDX-License-Identifier: BSD-3-Clause
#include "answers.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact_flow/analysis/near_grazing.h"
#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/derivative/cluster_reading.h"
#include "contact_flow/derivative/continued_outcomes.h"
#include "contact_flow/derivative/measured_errors.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/model_description.h"
#include "src/ros/request/request.h"
#include "src/session/directions.h"

namespace contact_flow {
namespace ros_interface {
namespace {

/// Most perturbed runs one comparison may ask for.
constexpr std::size_t kMaxRuns = 2048;

/// A run and its derivative, with the directions asked for.
struct Differentiated {
  ResolvedRun run;
  Directions directions;
  Trajectory trajectory;
  BDerivative derivative;
};

template <class Request>
Differentiated Differentiate(const Setup& setup, const Request& request) {
  Differentiated result;
  result.run = ResolveRun(setup, request);
  const ResolvedRun& run = result.run;
  BDerivativeOptions options = ResolveOptions(setup.derivative_options, request.derivative_options);
  options.variables = ResolveVariables(setup, request.by_inputs, request.by_parameters);
  result.directions = ResolveDirections(setup, run, DirectionsOf(request), options.variables);
  result.trajectory = Simulate(*setup.system, run.x, run.input, run.duration, run.options);
  result.derivative = DifferentiateOutcome(*setup.system, result.trajectory, options);
  return result;
}

/// The fields that both answers about a derivative begin with.
template <class Result>
Result Begin(const Setup& setup, const Differentiated& d) {
  const SystemDescription& description = setup.system->description();
  Result result;
  result.model = description.name;
  result.coordinates = description.coordinates;
  result.velocities = description.velocities;
  result.variables = VariableNames(description, d.derivative.options.variables);
  result.constraints = description.constraints;
  result.outcome = static_cast<std::uint8_t>(d.derivative.status.outcome);
  result.message = d.derivative.status.message;
  result.duration = d.run.duration;
  WarnOfRun(d.trajectory, &result);
  return result;
}

template <class Result>
void SetStatus(const Status& status, Result* result) {
  result->outcome = static_cast<std::uint8_t>(status.outcome);
  result->message = status.message;
}

template <class Result>
void AddNearGrazing(const Setup& setup, const std::vector<GrazingEvent>& events, Result* result) {
  const SystemDescription& description = setup.system->description();
  for (const GrazingEvent& event : events) {
    GrazingWarning warning;
    warning.kind = GrazingKindName(event.kind);
    if (event.constraint >= 0) {
      warning.constraint = description.constraints[static_cast<std::size_t>(event.constraint)];
    }
    warning.t = event.t;
    warning.value = event.value;
    warning.threshold = event.threshold;
    result->near_grazing.push_back(warning);
    result->warnings.push_back(
        MakeWarning(ResultWarning::NEAR_GRAZING, Describe(description, event), event.t));
  }
  if (events.empty()) return;
  AddNote(Describe(description, events.front()), &result->message);
  if (events.size() > 1)
    AddNote(std::to_string(events.size() - 1) + " more in near_grazing", &result->message);
}

bool Cancelled(const Setup& setup) { return setup.options.cancelled && setup.options.cancelled(); }

/// The errors, by a second run; a warning where it comes out otherwise.
template <class Result>
MeasuredErrors Measure(const Setup& setup, const Differentiated& d, Result* result) {
  MeasuredErrors errors(*setup.system, d.run.x, d.run.input, d.run.duration, d.run.options,
                        d.trajectory, d.derivative);
  const Status& status = errors.status();
  if (!status.ok()) {
    Warn(MakeWarning(static_cast<std::uint8_t>(status.outcome), status.message), result);
  }
  return errors;
}

void AddDerivatives(const Setup& setup, const Differentiated& d, OutcomeDerivative* result) {
  const auto count = static_cast<Eigen::Index>(d.directions.vectors.size());
  Matrix directions(count, count > 0 ? d.directions.vectors.front().size() : 0);
  Matrix derivatives(count, 2 * setup.system->dof()), in_order = derivatives;
  for (Eigen::Index i = 0; i < count; ++i) {
    if (Cancelled(setup)) return SetStatus({Outcome::kCancelled, "the node was stopped"}, result);
    const Vector& w = d.directions.vectors[static_cast<std::size_t>(i)];
    directions.row(i) = w;
    derivatives.row(i) = d.derivative(w);
    if (!derivatives.row(i).allFinite()) {
      return SetStatus({Outcome::kNonFinite, "the derivative along " +
                                                 d.directions.names[static_cast<std::size_t>(i)] +
                                                 " is not finite"},
                       result);
    }
    result->direction_modes.emplace_back();
    result->direction_modes.back().names =
        ToLabels(result->constraints, d.derivative.PerturbedModes(w));
    result->mode_words.emplace_back();
    result->mode_words.back().names = ToWords(result->constraints, d.derivative.PerturbedModes(w));
    const ClusterReading reading = ReadClusters(d.derivative, w);
    result->inner_radii.push_back(reading.inner_radius);
    in_order.row(i) = reading.in_order;
  }
  const ValidityEstimator validity(*setup.system, d.trajectory, d.derivative);
  for (const Vector& w : d.directions.vectors) {
    const ValidityRadius radius = validity(w);
    result->radii.push_back(radius.radius);
    result->radius_limits.push_back(Describe(setup.system->description(), radius));
  }
  result->direction_names = d.directions.names;
  result->directions = ToMsg(MatrixRef(directions));
  result->derivatives = ToMsg(MatrixRef(derivatives));
  result->in_order = ToMsg(MatrixRef(in_order));
  const MeasuredErrors errors = Measure(setup, d, result);
  for (const Vector& w : d.directions.vectors) {
    result->derivative_errors.push_back(errors.Along(w).maxCoeff());
  }
  result->final_error = ToMsg(VectorRef(errors.OfState()));
}

void AddPieces(const BDerivative& derivative, OutcomeDerivative* result) {
  try {
    const PiecewiseLinearMap map = derivative.Pieces();
    for (const LinearPiece& piece : map.pieces()) result->pieces.push_back(ToMsg(piece));
  } catch (const std::length_error& error) {
    SetStatus({Outcome::kTooManyPieces, error.what()}, result);
  } catch (const NotPiecewiseLinear& reason) {
    SetStatus({Outcome::kNotDifferentiable, reason.what()}, result);
  }
}

void AddContinuation(const Names& constraints, const ContinuedOutcome& end, ContactOrder* order) {
  order->continued = true;
  SetStatus(end.status, order);
  if (end.final_state.size() > 0) {
    const auto dof = static_cast<Eigen::Index>(order->v_after.size());
    order->final_q = ToMsg(VectorRef(end.final_state.head(end.final_state.size() - dof)));
    order->final_v = ToMsg(VectorRef(end.final_state.tail(dof)));
  }
  order->modes = ToLabels(constraints, end.modes);
  order->mode_words = ToWords(constraints, end.modes);
}

/// Where each order of the cluster that stops the derivative leads to, with a note on
/// what is not listed.
void AddOrders(const Setup& setup, const Differentiated& d, bool continue_orders,
               OutcomeDerivative* result) {
  if (d.derivative.status.ok() || d.derivative.events.empty()) return;
  const std::size_t k = d.derivative.events.size() - 1;  // the others are continuous
  const EventMap& event = d.derivative.events[k];
  const std::vector<OrderOutcome>& outcomes = event.outcomes();
  if (outcomes.empty() && event.status().outcome != Outcome::kDiscontinuous) return;
  for (const OrderOutcome& outcome : outcomes) {
    result->orders.push_back(ToMsg(setup.system->description(), outcome));
    result->orders.back().transition = static_cast<std::uint32_t>(k);
    result->orders.back().t = event.time();
  }
  const auto cut = [&](const std::string& how) {
    Warn(MakeWarning(ResultWarning::ORDERS_CUT, how, event.time()), result);
  };
  if (event.num_activations() > kMaxOrderedActivations) {
    cut("orders are listed for at most " + std::to_string(kMaxOrderedActivations) +
        " simultaneous contacts, not for " + std::to_string(event.num_activations()));
  } else if (outcomes.size() >= kMaxListedOrders) {
    cut("the list ends at " + std::to_string(kMaxListedOrders) + " orders");
  }
  if (!continue_orders) return;
  try {
    const std::vector<ContinuedOutcome> ends =
        ContinueOutcomes(*setup.system, d.run.input, d.trajectory.transitions[k], outcomes,
                         d.run.duration, d.run.options);
    for (std::size_t i = 0; i < ends.size(); ++i) {
      AddContinuation(result->constraints, ends[i], &result->orders[i]);
    }
  } catch (const std::length_error& error) {
    cut(error.what());
  }
}

}  // namespace

ContactTrajectory Answer(const Setup& setup, const SimulationRequest& request) {
  CheckMessage(request);
  ResolvedRun run = ResolveRun(setup, request);
  const int count = ResolveCount("samples", request.samples, kDefaultSamples, kMaxSamples);
  run.options.dense = count > 1;
  Trajectory trajectory = Simulate(*setup.system, run.x, run.input, run.duration, run.options);
  std::vector<GrazingEvent> near;
  // Of a run that a budget has ended none: where it was of time there is none left
  // to look for them.
  if (trajectory.status.outcome != Outcome::kBudgetExceeded) {
    try {
      near = FindNearGrazing(*setup.system, trajectory);
      const auto unnamed = [](const GrazingEvent& event) { return event.constraint < 0; };
      if (!run.options.dense && std::any_of(near.begin(), near.end(), unnamed)) {
        run.options.dense = true;
        near = FindNearGrazing(
            *setup.system, Simulate(*setup.system, run.x, run.input, run.duration, run.options));
      }
    } catch (const BudgetExceeded&) {
      if (trajectory.status.ok()) throw;  // else the run has told of it, and is kept
    }
  }
  ContactTrajectory result = ToMsg(setup.system->description(), trajectory, run.duration, count);
  AddForces(*setup.system, trajectory, &result);
  AddLimits(*setup.system, trajectory, &result);
  AddNearGrazing(setup, near, &result);
  return result;
}

OutcomeDerivative Answer(const Setup& setup, const DerivativeRequest& request) {
  CheckMessage(request);
  const Differentiated d = Differentiate(setup, request);
  const Eigen::Index dof = setup.system->dof(), nq = setup.system->num_positions();
  OutcomeDerivative result = Begin<OutcomeDerivative>(setup, d);
  result.final_q = ToMsg(VectorRef(d.trajectory.FinalState().head(nq)));
  result.final_v = ToMsg(VectorRef(d.trajectory.FinalState().tail(dof)));
  result.modes = ToModeIntervals(result.constraints, d.trajectory);
  result.margins = ToMsg(d.trajectory.margins);
  if (!d.derivative.status.ok()) {
    AddOrders(setup, d, request.continue_orders, &result);
    return result;
  }
  result.is_differentiable = d.derivative.IsDifferentiable();
  result.time_derivative = ToMsg(VectorRef(d.derivative.time));
  AddDerivatives(setup, d, &result);
  if (request.all_pieces) AddPieces(d.derivative, &result);
  WarnOfDirections(d.directions, &result);
  AddNearGrazing(setup, FindNearGrazing(*setup.system, d.trajectory), &result);
  return result;
}

DerivativeComparison Answer(const Setup& setup, const ComparisonRequest& request) {
  CheckMessage(request);
  const std::vector<double> alphas = ResolveAlphas(request.alphas);
  const Differentiated d = Differentiate(setup, request);
  DerivativeComparison result = Begin<DerivativeComparison>(setup, d);
  if (!d.derivative.status.ok()) return result;
  const std::vector<Vector>& vectors = d.directions.vectors;
  if (vectors.size() * alphas.size() > kMaxRuns) {
    throw std::invalid_argument("directions times alphas are " +
                                std::to_string(vectors.size() * alphas.size()) + " runs, at most " +
                                std::to_string(kMaxRuns) + " are accepted");
  }
  const SystemFactory again = [&](const ParameterValues& values) {
    return setup.WithParameters(values);
  };
  const MeasuredErrors errors = Measure(setup, d, &result);
  const std::size_t smallest =
      static_cast<std::size_t>(std::min_element(alphas.begin(), alphas.end()) - alphas.begin());
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    if (Cancelled(setup)) {
      SetStatus({Outcome::kCancelled, "the node was stopped"}, &result);
      return result;
    }
    const Vector prediction = d.derivative(vectors[i]);
    if (!prediction.allFinite()) {
      SetStatus(
          {Outcome::kNonFinite, "the derivative along " + d.directions.names[i] + " is not finite"},
          &result);
      return result;
    }
    const QuotientReport report = CompareWithQuotients(
        *setup.system, again, d.derivative.options.variables, d.run.x, d.run.input, d.run.duration,
        vectors[i], prediction, alphas, d.run.options, errors.Along(vectors[i]).maxCoeff());
    DirectionComparison comparison = ToMsg(result.constraints, report, prediction.size());
    comparison.name = d.directions.names[i];
    comparison.direction = ToMsg(VectorRef(vectors[i]));
    comparison.prediction = ToMsg(VectorRef(prediction));
    result.worst_error = std::max(result.worst_error, comparison.errors[smallest]);
    result.comparisons.push_back(comparison);
  }
  WarnOfDirections(d.directions, &result);
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
