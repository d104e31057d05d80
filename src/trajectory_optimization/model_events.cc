// SPDX-License-Identifier: BSD-3-Clause
// What runs cost by name: power and slip on the way, impulses at events.
#include <algorithm>
#include <vector>

#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "model_builder.h"
#include "named_costs.h"
#include "src/dynamics/impulse_jacobian.h"
#include "src/piecewise_linear/cone_interior.h"

namespace contact_flow {

/// w p² of the impact of transition k, whose events come in this order, the first of its changes of
/// the input being that to interval `passed` + 1; W has the tangents before it.
bool ModelBuilder::AddImpulses(std::size_t k, const std::vector<int>& order, std::size_t passed,
                               const Matrix& W, PieceModel* model, Status* status) const {
  const Vector& weight = problem_.impulse_weight;
  const EventMap& event = derivative_.events[k];
  const Transition& transition = event.transition();
  const ConstraintSet rigid = transition.activated - system_.compliant();
  if (weight.size() == 0 || rigid.Empty()) return true;
  const int d = system_.dof(), nq = system_.num_positions();
  const Vector q = transition.x_minus.head(nq), v = transition.x_minus.tail(d);
  const InverseInertia inertia(system_, q, v);
  const ConstraintSet held = transition.mode_before - system_.compliant();
  const ImpactResult result = SolveImpact(system_, inertia, v, rigid | held, transition.impact_law);
  bool costs = false;
  for (int i : result.hit) costs = costs || weight(i) > 0;
  if (!costs) return true;
  const auto is_other = [&](int i) { return !event.IsInputChange(i) && !rigid.Contains(i); };
  if (rigid.Size() > 1 || std::any_of(order.begin(), order.end(), is_other)) {
    *status = {Outcome::kNotDifferentiable,
               "a cost of impulses is not differentiated where several contacts are met at once"};
    return false;
  }
  const auto at = std::find(order.begin(), order.end(), *rigid.begin()) - order.begin();
  const auto place = static_cast<Eigen::Index>(at);
  Vector field = FieldAt(k, true);
  if (place > 0) {  // the input has changed by then
    const auto changes = static_cast<std::size_t>(place);
    ContactDynamics dynamics(system_, inputs_.values[passed + changes]);
    field = dynamics.Field(transition.x_minus, event.Modes(order)[changes - 1]).head(2 * d);
  }
  const Eigen::RowVectorXd time = event.Times(order).row(place) * W;
  const Matrix rates = W.topRows(2 * d) + field * time;
  const Matrix by_state =
      ImpulseJacobian(system_, inertia, q, v, result, result.hit, result.hit & held);
  for (int i : result.hit) {
    if (weight(i) > 0) AddSquare(weight(i), result.impulse(i), by_state.row(i) * rates, model);
  }
  return true;
}

/// Running costs by name: their gradient by one covector, of the second order what needs no more
/// than the tangents that there are.
bool ModelBuilder::AddRunning(PieceModel* model, Status* status) const {
  if (!unknowns_.HasRunningCost()) return true;
  RunDirection direction;
  const bool several = Count() > 1;
  if (several) {
    if (moves_) {
      *status = {Outcome::kNotDifferentiable,
                 "a cost of power is not differentiated where instants of the grid may move and "
                 "an event coincides with one"};
      return false;
    }
    if (!HaveLinearPrograms()) {
      *status = {Outcome::kNotDifferentiable,
                 "a direction inside a piece is found by linear programs: built without Clp"};
      return false;
    }
    direction = Inside(*model);
  }
  const CostGradient gradient =
      DifferentiateCost(system_, run_, RunningRate(problem_, system_), derivative_.options,
                        several ? &direction : nullptr, unknowns_.ConesOfInputs(y_));
  *status = gradient.status;
  if (!status->ok()) return false;
  const std::size_t count = problem_.inputs.grid.size();
  for (std::size_t k = 0; k < count; ++k) {
    const auto interval = static_cast<Eigen::Index>(k);
    if (gradient.inputs.size() > 0) {
      model->gradient += unknowns_.InputRows(y_, k).transpose() * gradient.inputs.col(interval);
    }
    if (!moves_) continue;
    const double by_time = k + 1 < count ? gradient.instants(interval) : gradient.horizon;
    model->gradient += by_time * unknowns_.InstantRow(k + 1).transpose();
  }
  for (std::size_t i = 0; i < problem_.choose_initial.size(); ++i) {
    model->gradient(unknowns_.Initial(i)) += gradient.initial(problem_.choose_initial[i]);
  }
  for (std::size_t i = 0; i < problem_.choose_parameters.size(); ++i) {
    model->gradient(unknowns_.Parameter(i)) += gradient.parameters(static_cast<Eigen::Index>(i));
  }
  AddPowerCurvature(model);
  return true;
}

/// 2 w ∫ v² (δu)² dt; where inputs are led linearly as if v² were the same all over an interval.
void ModelBuilder::AddPowerCurvature(PieceModel* model) const {
  const Matrix squares = SquaresOf(problem_, run_, system_.num_positions());
  for (std::size_t i = 0; i < problem_.power.size() && problem_.choose_inputs; ++i) {
    const PowerTerm& term = problem_.power[i];
    for (std::size_t k = 0; k < problem_.inputs.grid.size(); ++k) {
      const double curvature =
          2 * term.weight * squares(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
      const int first = unknowns_.Input(k, term.input);
      if (!problem_.linear_inputs) {
        model->hessian(first, first) += curvature;
        continue;
      }
      const int last = unknowns_.Input(k + 1, term.input);
      model->hessian(first, first) += curvature / 3;
      model->hessian(last, last) += curvature / 3;
      model->hessian(first, last) += curvature / 6;
      model->hessian(last, first) += curvature / 6;
    }
  }
}

/// 2 w ∫ |D(T v) W|² dt over an arc by its two ends, one at a time; W has the tangents there.
void ModelBuilder::AddSlipCurvature(std::size_t arc, bool end, const Matrix& W,
                                    PieceModel* model) const {
  if (!unknowns_.HasSlipCost()) return;
  const Arc& at = run_.arcs[arc];
  const int d = system_.dof(), nq = system_.num_positions();
  const Vector& x = end ? at.x_end : at.x_begin;
  const double length = at.t_end - at.t_begin;
  ConstraintTerms terms;
  ResidualJacobian jacobian;
  for (int c : at.mode) {
    if (problem_.slip_weight(c) == 0) continue;
    if (terms.gap.size() == 0) {
      const Vector q = x.head(nq), v = x.tail(d);
      system_.Constraints(q, v, &terms);
      system_.DifferentiateImpact(q, Vector::Zero(d), Vector::Zero(system_.num_rows()), v,
                                  &jacobian);
    }
    const Friction& friction = system_.friction()[static_cast<std::size_t>(c)];
    for (int row = friction.row; row < friction.row + friction.dimension; ++row) {
      const Eigen::RowVectorXd rate = jacobian.constraint_q.row(row) * W.topRows(d) +
                                      terms.jacobian.row(row) * W.middleRows(d, d);
      model->hessian += problem_.slip_weight(c) * length * rate.transpose() * rate;
    }
  }
}

/// A direction inside the piece.
RunDirection ModelBuilder::Inside(const PieceModel& model) const {
  std::vector<Eigen::RowVectorXd> rows;
  for (const OrderRow& order : model.orders) {
    if (std::abs(order.slack) <= 2 * problem_.kink_interval) {
      rows.push_back(order.row / order.row.norm());
    }
  }
  Matrix cone(static_cast<Eigen::Index>(rows.size()), unknowns_.size());
  for (std::size_t i = 0; i < rows.size(); ++i) cone.row(static_cast<Eigen::Index>(i)) = rows[i];
  Vector inside = Vector::Zero(unknowns_.size());
  InteriorRadius(cone, &inside);
  RunDirection direction;
  direction.initial = Vector::Zero(2 * system_.dof());
  for (std::size_t i = 0; i < problem_.choose_initial.size(); ++i) {
    direction.initial(problem_.choose_initial[i]) += inside(unknowns_.Initial(i));
  }
  direction.inputs =
      Matrix::Zero(system_.num_inputs(), static_cast<Eigen::Index>(problem_.inputs.grid.size()));
  for (std::size_t k = 0; k < problem_.inputs.grid.size(); ++k) {
    direction.inputs.col(static_cast<Eigen::Index>(k)) = unknowns_.InputRows(y_, k) * inside;
  }
  direction.parameters = Vector::Zero(static_cast<Eigen::Index>(problem_.choose_parameters.size()));
  for (std::size_t i = 0; i < problem_.choose_parameters.size(); ++i) {
    direction.parameters(static_cast<Eigen::Index>(i)) = inside(unknowns_.Parameter(i));
  }
  return direction;
}

}  // namespace contact_flow
