// SPDX-License-Identifier: BSD-3-Clause
// What runs cost by name: power on the way, impulses at events.
#include <algorithm>
#include <vector>

#include "contact_flow/derivative/cone_interior.h"
#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/impulse_jacobian.h"
#include "model_builder.h"
#include "named_costs.h"

namespace contact_flow {

/// w p² of the impact of transition k, whose events come in this order, the first of its changes of
/// the input being that to interval `passed` + 1; W has the tangents before it.
bool ModelBuilder::AddImpulses(std::size_t k, const std::vector<int>& order, std::size_t passed,
                               const Matrix& W, PieceModel* model, Status* status) const {
  const Vector& weight = problem_.impulse_weight;
  const EventMap& event = derivative_.events[k];
  const Transition& transition = event.transition();
  const ContactMode rigid = transition.activated.Members() - system_.compliant();
  if (weight.size() == 0 || rigid.Empty()) return true;
  const int d = system_.dof(), nq = system_.num_positions();
  const Vector q = transition.x_minus.head(nq), v = transition.x_minus.tail(d);
  const InverseInertia inertia(system_, q, v);
  const ContactMode held = transition.mode_before.Members() - system_.compliant();
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

/// ∫ w (u v)² dt: its gradient by one covector, of the second order what does not need that of v.
bool ModelBuilder::AddPower(PieceModel* model, Status* status) const {
  if (problem_.power.empty()) return true;
  RunDirection direction;
  const bool several = Count() > 1;
  if (several) {
    if (moves_) {
      *status = {Outcome::kNotDifferentiable,
                 "a cost of power is not differentiated where instants of the grid may move and "
                 "an event coincides with one"};
      return false;
    }
    direction = Inside(*model);
  }
  const CostGradient gradient =
      DifferentiateCost(system_, run_, PowerRate(problem_, system_.num_positions()),
                        derivative_.options, several ? &direction : nullptr);
  *status = gradient.status;
  if (!status->ok()) return false;
  const std::size_t count = problem_.inputs.grid.size();
  const Matrix squares = SquaresOf(problem_, run_, system_.num_positions());
  for (std::size_t k = 0; k < count; ++k) {
    const auto interval = static_cast<Eigen::Index>(k);
    for (int j = 0; j < system_.num_inputs(); ++j) {
      const int place = unknowns_.Input(k, j);
      if (place >= 0) model->gradient(place) += gradient.inputs(j, interval);
    }
    for (std::size_t i = 0; i < problem_.power.size(); ++i) {
      const int place = unknowns_.Input(k, problem_.power[i].input);
      const double curvature =
          2 * problem_.power[i].weight * squares(static_cast<Eigen::Index>(i), interval);
      if (place >= 0) model->hessian(place, place) += curvature;
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
  return true;
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
    for (int j = 0; j < system_.num_inputs(); ++j) {
      const int place = unknowns_.Input(k, j);
      if (place >= 0) direction.inputs(j, static_cast<Eigen::Index>(k)) = inside(place);
    }
  }
  direction.parameters = Vector::Zero(static_cast<Eigen::Index>(problem_.choose_parameters.size()));
  for (std::size_t i = 0; i < problem_.choose_parameters.size(); ++i) {
    direction.parameters(static_cast<Eigen::Index>(i)) = inside(unknowns_.Parameter(i));
  }
  return direction;
}

}  // namespace contact_flow
