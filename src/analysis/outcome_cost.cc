// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/outcome_cost.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "contact_flow/piecewise_linear/section.h"

namespace contact_flow {
namespace {

void Require(bool fine, const std::string& what) {
  if (!fine) throw std::invalid_argument("outcome cost: " + what);
}

/// The tangent coordinate that belongs to position number i; −1 when none does alone.
int TangentOf(const MechanicalSystem& system, int i) {
  const SystemDescription& names = system.description();
  const auto found =
      std::find(names.velocities.begin(), names.velocities.end(), names.coordinates[i]);
  return found == names.velocities.end() ? -1 : static_cast<int>(found - names.velocities.begin());
}

void ValidateProblem(const MechanicalSystem& system, const OutcomeProblem& problem) {
  const Eigen::Index size = system.state_size(), m = system.num_inputs();
  Require(
      problem.x.size() == size && problem.target.size() == size && problem.weight.size() == size,
      "state, target and weight need " + std::to_string(size) + " entries");
  Require(problem.u.size() == m && problem.effort.size() == m,
          "input and effort need " + std::to_string(m) + " entries");
  Require(problem.weight.minCoeff() >= 0 && (m == 0 || problem.effort.minCoeff() >= 0),
          "weights must be ≥ 0");
  Require(!problem.unknowns.empty(), "nothing may be chosen");
  for (const OutcomeUnknown& unknown : problem.unknowns) {
    const int sizes[] = {system.num_positions(), system.dof(), system.num_inputs()};
    Require(unknown.index >= 0 && unknown.index < sizes[static_cast<int>(unknown.kind)],
            "an unknown has no such index");
    Require(
        unknown.kind != OutcomeUnknown::Kind::kPosition || TangentOf(system, unknown.index) >= 0,
        "a part of a quaternion cannot be chosen alone");
  }
}

double& ValueOf(const MechanicalSystem& system, const OutcomeUnknown& unknown,
                OutcomeProblem* problem) {
  if (unknown.kind == OutcomeUnknown::Kind::kInput) return problem->u(unknown.index);
  const bool velocity = unknown.kind == OutcomeUnknown::Kind::kVelocity;
  return problem->x(unknown.index + (velocity ? system.num_positions() : 0));
}

/// Columns: the tangents (δq, δv, δu) of a change of each unknown.
Matrix Columns(const MechanicalSystem& system, const OutcomeProblem& problem) {
  const int d = system.dof();
  Matrix columns =
      Matrix::Zero(2 * d + system.num_inputs(), static_cast<Eigen::Index>(problem.unknowns.size()));
  for (std::size_t k = 0; k < problem.unknowns.size(); ++k) {
    const OutcomeUnknown& unknown = problem.unknowns[k];
    const int offset = unknown.kind == OutcomeUnknown::Kind::kPosition   ? 0
                       : unknown.kind == OutcomeUnknown::Kind::kVelocity ? d
                                                                         : 2 * d;
    const int i = unknown.kind == OutcomeUnknown::Kind::kPosition ? TangentOf(system, unknown.index)
                                                                  : unknown.index;
    columns(offset + i, static_cast<Eigen::Index>(k)) = 1;
  }
  return columns;
}

double Cost(const OutcomeProblem& problem, const Vector& end) {
  return 0.5 * problem.weight.dot((end - problem.target).cwiseAbs2()) +
         0.5 * problem.effort.dot(problem.u.cwiseAbs2());
}

/// Gradient of the first sum by the tangents (δq, δv) at the end [2d].
Vector EndGradient(const MechanicalSystem& system, const OutcomeProblem& problem,
                   const Vector& end) {
  const int d = system.dof(), nq = system.num_positions();
  const Vector by_state = problem.weight.cwiseProduct(end - problem.target);
  Vector gradient(2 * d);
  Vector rate(nq);
  const Vector q = end.head(nq);
  for (int k = 0; k < d; ++k) {
    const Vector unit = Vector::Unit(d, k);
    system.space().Rate(q.data(), unit.data(), rate.data());
    gradient(k) = by_state.head(nq).dot(rate);
  }
  gradient.tail(d) = by_state.tail(d);
  return gradient;
}

CostValue Undefined(const std::string& why) {
  CostValue value;
  value.defined = false;
  value.message = why;
  return value;
}

/// Adds DJ = ∂J/∂x B(columns δy) + r∘u δu.
void AddMap(const MechanicalSystem& system, const OutcomeProblem& problem, const Trajectory& run,
            CostValue* value) {
  const BDerivative B = DifferentiateOutcome(system, run, problem.derivative);
  value->message = B.status.message;
  if (!B.status.ok()) return;
  const Matrix columns = Columns(system, problem);
  const Vector gradient = EndGradient(system, problem, run.FinalState());
  Vector by_input = Vector::Zero(columns.rows());
  by_input.tail(problem.u.size()) = problem.effort.cwiseProduct(problem.u);
  try {
    PiecewiseLinearMap map = InBases(B.Pieces(), gradient, columns);
    std::vector<LinearPiece> pieces = map.pieces();
    for (LinearPiece& piece : pieces) piece.matrix += by_input.transpose() * columns;
    value->map = PiecewiseLinearMap(std::move(pieces));
    value->has_map = true;
  } catch (const std::length_error& limit) {
    value->message = limit.what();
  } catch (const NotPiecewiseLinear& reason) {
    value->message = reason.what();
  }
}

}  // namespace

Vector UnknownValues(const MechanicalSystem& system, const OutcomeProblem& problem) {
  ValidateProblem(system, problem);
  OutcomeProblem values = problem;
  Vector y(problem.unknowns.size());
  for (std::size_t k = 0; k < problem.unknowns.size(); ++k) {
    y(static_cast<Eigen::Index>(k)) = ValueOf(system, problem.unknowns[k], &values);
  }
  return y;
}

OutcomeProblem WithUnknowns(const MechanicalSystem& system, OutcomeProblem problem,
                            const VectorRef& y) {
  Require(y.size() == static_cast<Eigen::Index>(problem.unknowns.size()),
          "a value for each unknown is needed");
  for (std::size_t k = 0; k < problem.unknowns.size(); ++k) {
    ValueOf(system, problem.unknowns[k], &problem) = y(static_cast<Eigen::Index>(k));
  }
  return problem;
}

NonsmoothCost MakeOutcomeCost(const MechanicalSystem& system, const OutcomeProblem& problem) {
  ValidateProblem(system, problem);
  OutcomeProblem asked = problem;
  asked.derivative.variables = {};
  asked.derivative.variables.inputs = true;
  return [&system, asked](const Vector& y, CostQuery query) {
    OutcomeProblem at = WithUnknowns(system, asked, y);
    at.simulate.dense = query != CostQuery::kValue;
    try {
      Trajectory run = Simulate(system, at.x, at.u, at.duration, at.simulate);
      if (!run.status.ok()) return Undefined(run.status.message);
      CostValue value;
      value.cost = Cost(at, run.FinalState());
      if (query == CostQuery::kValue) return value;
      if (query == CostQuery::kKinks && run.margins.event_interval <= at.kink_interval) {
        at.simulate.simultaneity_tolerance = at.kink_interval;
        run = Simulate(system, at.x, at.u, at.duration, at.simulate);
      }
      AddMap(system, at, run, &value);
      return value;
    } catch (const std::invalid_argument& refusal) {
      return Undefined(refusal.what());
    }
  };
}

}  // namespace contact_flow
