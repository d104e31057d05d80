// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/b_derivative.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "contact_flow/budget.h"
#include "contact_flow/derivative/start_directions.h"
#include "contact_flow/derivative/variation.h"
#include "end_event.h"
#include "error_estimate.h"
#include "run_preparation.h"

namespace contact_flow {
namespace {

/// A piece of the start, or two where the other side of a face reverses a slip.
std::vector<LinearPiece> WithReversal(const StartCone::Reversal& reversal, LinearPiece piece) {
  if (reversal.side.size() == 0) return {piece};
  piece.cone.conservativeResize(piece.cone.rows() + 1, reversal.side.size());
  LinearPiece reversed = piece;
  piece.cone.bottomRows(1) = reversal.side.normalized().transpose();
  reversed.cone.bottomRows(1) = -piece.cone.bottomRows(1);
  reversed.matrix *= reversal.matrix;
  return {piece, reversed};
}

}  // namespace

/// w with (δu, δp) = 0 where they are left out.
Vector BDerivative::Complete(const VectorRef& w) const {
  if (!status.ok()) throw std::domain_error("there is no derivative: " + status.message);
  const Eigen::Index size = arcs.front().cols(), tangents = time.size();
  if (w.size() != size && w.size() != tangents) {
    throw std::invalid_argument("the direction has " + std::to_string(w.size()) +
                                " entries: " + std::to_string(tangents) + " (δq, δv) or " +
                                std::to_string(size) + " (δq, δv, δu, δp) are needed");
  }
  Vector complete = Vector::Zero(size);
  complete.head(w.size()) = w;
  return complete;
}

Vector BDerivative::Begin(const VectorRef& w) const {
  const Vector begun = start(Complete(w));
  return start_stop(begun, start.Brushed(begun));
}

Vector BDerivative::Along(std::size_t k, const Vector& w) const {
  if (k < held.size()) held[k].Require(w);
  return arcs[k] * w;
}

Vector BDerivative::First(const VectorRef& w) const { return Along(0, Begin(w)); }

Status BDerivative::Together() const {
  for (const HeldTogether& arc : held) {
    if (!arc.Whole().ok()) return arc.Whole();
  }
  return {};
}

Vector BDerivative::operator()(const VectorRef& w) const {
  const BudgetStage stage("the derivative along a direction");
  Vector tangent = First(w);
  for (std::size_t k = 0; k < events.size(); ++k) tangent = Along(k + 1, events[k](tangent));
  return tangent.head(time.size());
}

Vector BDerivative::operator()(double dt, const VectorRef& w) const {
  if (dt > 0 && input_changes_at_end) {
    throw std::domain_error(
        "the input changes at the end T: longer runs, dt > 0, have another derivative than shorter "
        "ones; ask a run that ends behind T for it");
  }
  return dt * time + (*this)(w);
}

std::vector<ContactMode> BDerivative::PerturbedModes(const VectorRef& w) const {
  std::vector<ContactMode> modes = {initial_mode};
  Vector tangent = First(w);
  for (std::size_t k = 0; k < events.size(); ++k) {
    const std::vector<ContactMode> passed = events[k].PerturbedModes(tangent);
    modes.insert(modes.end(), passed.begin(), passed.end());
    tangent = Along(k + 1, events[k](tangent));
  }
  return modes;
}

bool BDerivative::IsDifferentiable() const {
  if (!status.ok() || !Together().ok() || !start.Empty() || !start_stop.PiecewiseLinear().ok())
    return false;
  for (const EventMap& event : events) {
    if (!event.IsDifferentiable(options.kink_tolerance)) return false;
  }
  return true;
}

Status BDerivative::PiecewiseLinear() const {
  if (!status.ok()) return status;
  if (const Status together = Together(); !together.ok()) return together;
  if (!start.PiecewiseLinear().ok()) return start.PiecewiseLinear();
  if (const Status stops = start_stop.PiecewiseLinear(); !stops.ok()) return stops;
  for (const EventMap& event : events) {
    if (!event.PiecewiseLinear().ok()) return event.PiecewiseLinear();
  }
  return {};
}

PiecewiseLinearMap BDerivative::FirstPieces() const {
  if (const Status together = Together(); !together.ok())
    throw NotPiecewiseLinear(together.message);
  if (!start.PiecewiseLinear().ok()) throw NotPiecewiseLinear(start.PiecewiseLinear().message);
  if (const Status stops = start_stop.PiecewiseLinear(); !stops.ok()) {
    throw NotPiecewiseLinear(stops.message);
  }
  const PiecewiseLinearMap map = PiecewiseLinearMap::Linear(
      start_stop.Empty() ? arcs.front() : Matrix(arcs.front() * start_stop.matrix()));
  if (start.Empty()) return map;
  LinearPiece piece = map.pieces().front();
  piece.cone = start.Cone();
  return PiecewiseLinearMap(WithReversal(start.reversal(), piece));
}

PiecewiseLinearMap BDerivative::Pieces() const {
  BudgetStage stage("the pieces, event by event", events.size());
  PiecewiseLinearMap map = FirstPieces();
  for (std::size_t k = 0; k < events.size(); ++k) {
    map = events[k].Pieces(options.max_activations_for_pieces).After(map, options.max_pieces);
    map = PiecewiseLinearMap::Linear(arcs[k + 1]).After(map, options.max_pieces);
    stage.Next();
  }
  if (map.rows() == time.size()) return map;
  return PiecewiseLinearMap::Linear(Matrix::Identity(time.size(), map.rows()))
      .After(map, options.max_pieces);
}

void BDerivative::CarryNeglected() {
  const Eigen::Index d = time.size() / 2;
  neglected_jump = Vector::Zero(2 * d);
  neglected_derivative = 0;
  for (std::size_t k = 0; k < events.size(); ++k) {
    const ClusterReport& cluster = events[k].cluster();
    const bool nothing = cluster.neglected_jump.size() == 0 || cluster.neglected_jump.isZero(0);
    if (nothing && cluster.neglected_derivative == 0) continue;
    // What comes before and after, along one selection of each other event.
    Matrix before = arcs[0], after = arcs[k + 1];
    AskBudget();
    for (std::size_t j = 0; j < k; ++j) before = arcs[j + 1] * events[j].AnySelection() * before;
    for (std::size_t j = k + 1; j < events.size(); ++j) {
      after = arcs[j + 1] * events[j].AnySelection() * after;
    }
    const Matrix effect = after.topRows(2 * d).cwiseAbs();
    if (!nothing) neglected_jump += effect.middleCols(d, d) * cluster.neglected_jump;
    // |L D R| ≤ ‖L‖_∞ max|D| ‖R‖_1, entry by entry.
    neglected_derivative += effect.middleCols(d, d).rowwise().sum().maxCoeff() *
                            cluster.neglected_derivative *
                            before.cwiseAbs().colwise().sum().maxCoeff();
  }
}

BDerivative DifferentiateOutcome(const MechanicalSystem& system, const Trajectory& trajectory,
                                 const BDerivativeOptions& options) {
  return DifferentiateOutcome(system, trajectory, options, {});
}

BDerivative DifferentiateOutcome(const MechanicalSystem& system, const Trajectory& trajectory,
                                 const BDerivativeOptions& options, const InputCones& cones) {
  BDerivative derivative =
      DifferentiateArcs(system, trajectory, 0, trajectory.arcs.size() - 1, options, cones);
  if (derivative.status.ok()) {
    ConstraintSet switches;
    derivative.status = CheckEnd(system, trajectory, derivative.trust.state_error, &switches);
    const double duration = trajectory.t_end() - trajectory.t_begin();
    for (int i : switches) {
      derivative.start.EndOnSwitch(
          i, SideOfSwitch(system, trajectory, options.variables, duration, i));
    }
  }
  return derivative;
}

BDerivative DifferentiateArcs(const MechanicalSystem& system, const Trajectory& trajectory,
                              std::size_t first, std::size_t last,
                              const BDerivativeOptions& options, const InputCones& cones) {
  BDerivative derivative;
  derivative.options = options;
  RunPreparation run(system, trajectory, first, last, options.variables, cones);
  if (!run.Begin(&derivative)) return derivative;
  const ArcProduct carry = [&derivative](std::size_t k, Matrix* columns) {
    *columns = derivative.arcs[k] * *columns;
  };
  try {
    if (!run.MakeEvents(&derivative)) return derivative;
    std::vector<PropagationErrors> errors;
    BudgetStage propagation("the tangents of the arcs", last - first + 1);
    for (std::size_t k = first; k <= last; ++k, propagation.Next()) {
      if (run.clusters().Around(k) != nullptr) {
        const int size = run.size();
        derivative.arcs.push_back(Matrix::Identity(size, size));
        derivative.held.emplace_back();
        errors.emplace_back();
        continue;
      }
      derivative.status = run.CheckBefore(k);
      if (!derivative.status.ok()) return derivative;
      VariationStatistics statistics;
      errors.emplace_back();
      derivative.arcs.push_back(PropagateArc(run.dynamics(k), trajectory.arcs[k], options.tolerance,
                                             &statistics, &errors.back()));
      derivative.status = run.CheckAfter(k, statistics);
      if (!derivative.status.ok()) return derivative;
      derivative.held.emplace_back(run.dynamics(k), trajectory.arcs[k], options.tolerance);
      derivative.trust.flow_law = std::max(derivative.trust.flow_law, statistics.flow_law_residual);
    }
    derivative.status = run.CheckTouchingContacts(derivative, carry);
    if (!derivative.status.ok()) return derivative;
    derivative.time = run.EndField();
    derivative.input_changes_at_end = trajectory.input_changes_at_end;
    derivative.status = run.CheckLaw(carry, &derivative);
    if (!derivative.status.ok()) return derivative;
    derivative.CarryNeglected();
    EstimateErrors(trajectory, first, run.DynamicsOfArcs(), errors, &derivative);
  } catch (const std::domain_error& reason) {
    derivative.status = {Outcome::kNotDifferentiable, reason.what()};
  } catch (const BudgetExceeded& reason) {
    derivative.status = {OutcomeOf(reason), reason.what()};
  }
  return derivative;
}

Vector ProjectAdmissible(const MechanicalSystem& system, const VectorRef& x, ContactMode mode,
                         const VectorRef& w, const Variables& variables) {
  // Entries (δu, δp) that are left out are zero.
  const bool whole = w.size() > 2 * system.dof();
  return StartDirections(system, x, mode, StartCone(), whole ? variables : Variables()).Project(w);
}

}  // namespace contact_flow
