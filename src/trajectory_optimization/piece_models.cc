// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/piece_models.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "contact_flow/budget.h"
#include "model_builder.h"
#include "next_touchdown.h"

namespace contact_flow {
namespace {

/// A run that meets a contact at its end goes on for so many times what counts as one instant.
constexpr double kBeyond = 20;

/// With friction pieces are not orders of events: not kOk where there are several.
Status CheckFriction(const BDerivative& derivative) {
  for (const EventMap& event : derivative.events) {
    AskBudget();
    if (event.HasOnePiece() || event.IsDifferentiable(derivative.options.kink_tolerance)) continue;
    return {Outcome::kNotDifferentiable,
            "contacts have friction, and what happens at t = " + std::to_string(event.time()) +
                " s has several pieces, which are not orders of events"};
  }
  return {};
}

/// The models of a run.
PieceModels ModelsOf(const Unknowns& unknowns, const MechanicalSystem& system, const Vector& y,
                     std::size_t max_pieces, const Multipliers& multipliers,
                     const Trajectory& run) {
  PieceModels models;
  const TrajectoryProblem& problem = unknowns.problem();
  models.status = run.status;
  if (!run.status.ok()) return models;
  BDerivativeOptions options = problem.derivative;
  options.variables = {};
  options.variables.inputs = true;
  options.variables.parameters = problem.choose_parameters;
  const BDerivative derivative =
      DifferentiateOutcome(system, run, options, unknowns.ConesOfInputs(y));
  models.status = derivative.PiecewiseLinear();
  if (!models.status.ok()) return models;
  // Where neither start nor surfaces move, what touches and leaves does so all the same.
  const bool moves = !problem.choose_initial.empty() || !problem.choose_parameters.empty();
  if (moves && !(derivative.start.Empty() && derivative.start_stop.Empty())) {
    models.status = {Outcome::kNotDifferentiable,
                     "the run starts where contacts touch: not all directions are admitted"};
    return models;
  }
  if (system.HasFriction()) {
    models.status = CheckFriction(derivative);
    if (!models.status.ok()) return models;
  }
  for (const EventMap& event : derivative.events) {
    if (event.num_activations() <= options.max_activations_for_pieces) continue;
    models.status = {Outcome::kTooManyPieces,
                     std::to_string(event.num_activations()) + " events coincide at t = " +
                         std::to_string(event.time()) + " s: pieces are made of at most " +
                         std::to_string(options.max_activations_for_pieces)};
    return models;
  }
  ModelBuilder builder(unknowns, system, y, multipliers, run, derivative);
  models.cost = builder.Cost();
  if (!std::isfinite(models.cost)) {
    models.status = {Outcome::kNotDifferentiable, "a touchdown of the conditions does not happen"};
    return models;
  }
  if (builder.Count() > max_pieces) {
    models.status = {Outcome::kTooManyPieces, "the cost has " + std::to_string(builder.Count()) +
                                                  " pieces: at most " + std::to_string(max_pieces) +
                                                  " are taken"};
    return models;
  }
  const double n = unknowns.size();
  AskMemory(static_cast<double>(builder.Count()) * 8 * n * n,
            "the second order of " + std::to_string(builder.Count()) + " pieces");
  models.clusters = builder.Clusters();
  for (std::size_t i = 0; i < builder.Count(); ++i) {
    AskBudget();
    models.pieces.emplace_back();
    if (!builder.Build(i, &models.pieces.back(), &models.status)) {
      models.pieces.clear();
      return models;
    }
  }
  return models;
}

}  // namespace

PieceModels MakePieceModels(const Unknowns& unknowns, const Vector& y, std::size_t max_pieces,
                            const Multipliers& multipliers) {
  const TrajectoryProblem& problem = unknowns.problem();
  const std::shared_ptr<const MechanicalSystem> system = unknowns.SystemAt(y);
  const double together = std::max(problem.kink_interval, problem.simulate.simultaneity_tolerance);
  const Trajectory run = unknowns.Run(*system, y, together, true);
  const auto models_of = [&](const Trajectory& of) {
    return ModelsOf(unknowns, *system, y, max_pieces, multipliers, of);
  };
  const bool may_meet = run.status.ok() && !system->HasFriction();
  if (!may_meet || !IsMetAtEnd(*system, run, together)) return models_of(run);
  if (unknowns.HasRunningCost()) {
    PieceModels one = models_of(run);
    if (one.status.outcome == Outcome::kDiscontinuous) {
      one.status.message =
          "a cost of power is not differentiated where a contact is met at the end: " +
          one.status.message;
    }
    return one;
  }
  const Trajectory longer = unknowns.RunBeyond(*system, y, together, true, kBeyond * together);
  PieceModels both = models_of(longer);
  if (both.status.ok()) return both;
  // Where the cost jumps at T there is the side that the run is on.
  PieceModels side = models_of(run);
  if (!side.status.ok() && longer.status.ok()) side.status = both.status;
  return side;
}

}  // namespace contact_flow
