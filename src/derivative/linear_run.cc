// SPDX-License-Identifier: BSD-3-Clause
#include "linear_run.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <string>

#include "contact_flow/budget.h"
#include "cost_rate.h"
#include "error_estimate.h"

namespace contact_flow {
namespace {

Eigen::Index CountIntervals(const Trajectory& trajectory) {
  Eigen::Index count = 1;
  for (const Transition& transition : trajectory.transitions) count += transition.changes_input;
  return count;
}

}  // namespace

void RequireDirectionSize(Eigen::Index size, Eigen::Index needed, const char* name) {
  if (size == 0 || size == needed) return;
  throw std::invalid_argument("direction: " + std::string(name) + " has " + std::to_string(size) +
                              " entries: " + std::to_string(needed) + " or none are needed");
}

LinearRun::LinearRun(const MechanicalSystem& system, const Trajectory& trajectory,
                     const RunCost& cost, const BDerivativeOptions& options,
                     const RunDirection* direction, const InputCones& cones)
    : system_(system),
      run_(trajectory),
      cost_(cost),
      direction_(direction),
      d2_(2 * system.dof()),
      parameters_(static_cast<Eigen::Index>(options.variables.parameters.size())),
      inputs_(options.variables.inputs ? system.num_inputs() : 0),
      intervals_(CountIntervals(trajectory)),
      preparation_(system, trajectory, 0, trajectory.arcs.size() - 1, options.variables, cones) {
  derivative_.options = options;
  if (direction == nullptr) return;
  RequireDirectionSize(direction->initial.size(), d2_, "initial");
  RequireDirectionSize(direction->inputs.size(), inputs_ * intervals_, "inputs");
  RequireDirectionSize(direction->parameters.size(), parameters_, "parameters");
}

bool LinearRun::Make(CostGradient* gradient) {
  gradient_ = gradient;
  const bool made = preparation_.Begin(&derivative_) && preparation_.MakeEvents(&derivative_) &&
                    ChoosePiece() && MakeArcs() && CheckArcs();
  gradient->status = derivative_.status;
  if (made) FindPieces();
  return made;
}

bool LinearRun::Refuse(const std::string& why) {
  derivative_.status = {Outcome::kNotPiecewiseLinear, why};
  return false;
}

bool LinearRun::IsKink(const EventMap& event) const {
  return !event.HasOnePiece() && !event.IsDifferentiable(derivative_.options.kink_tolerance);
}

/// Whether the start and all events are known to have one piece, or a direction is given.
bool LinearRun::ChoosePiece() {
  const Status starts = derivative_.start.PiecewiseLinear();
  const Status stops = derivative_.start_stop.PiecewiseLinear();
  gradient_->whole = derivative_.start.Empty() && stops.ok();
  if (direction_ == nullptr && !(starts.ok() && stops.ok())) {
    return Refuse((starts.ok() ? stops : starts).message);
  }
  for (const EventMap& event : derivative_.events) {
    AskBudget();
    // With friction all pieces are looked for, which a direction need not wait for.
    if (direction_ != nullptr && system_.HasFriction()) {
      gradient_->whole = gradient_->whole && event.HasOnePiece();
      continue;
    }
    if (!IsKink(event)) continue;
    gradient_->whole = false;
    if (direction_ != nullptr) continue;
    std::ostringstream message;
    message.precision(12);
    message << "at t = " << event.time() << " s "
            << event.ActivatedConstraints().ToString(system_.description().constraints)
            << (event.num_input_changes() > 0 ? " and a change of the input" : "")
            << " coincide, and their orders have different derivatives: the gradient is that of "
               "a piece, which a direction chooses";
    return Refuse(message.str());
  }
  return true;
}

bool LinearRun::MakeArcs() {
  BudgetStage stage("the tangents of the arcs", run_.arcs.size());
  arcs_.reserve(run_.arcs.size());
  for (std::size_t k = 0; k < run_.arcs.size(); ++k, stage.Next()) {
    Arc point;  // inside a cluster: without length
    const bool inside = preparation_.clusters().Around(k) != nullptr;
    if (inside) {
      point.mode = run_.arcs[k].mode;
      point.u = run_.arcs[k].u;
      point.x_begin = point.x_end = run_.arcs[k].x_end;
      point.t_begin = point.t_end = run_.arcs[k].t_end;
    } else {
      derivative_.status = preparation_.CheckBefore(k);
      if (!derivative_.status.ok()) return false;
    }
    VariationStatistics statistics;
    arcs_.emplace_back(preparation_.dynamics(k), inside ? point : run_.arcs[k],
                       derivative_.options.tolerance, &cost_, &statistics);
    gradient_->statistics.jacobians += statistics.jacobians;
    gradient_->statistics.steps += statistics.steps;
    gradient_->statistics.rejected_steps += statistics.rejected_steps;
    gradient_->flow_law = std::max(gradient_->flow_law, statistics.flow_law_residual);
    gradient_->cost += inside ? ShortCost(cost_, run_.arcs[k]) : arcs_.back().cost();
    if (inside) continue;
    derivative_.status = preparation_.CheckAfter(k, statistics);
    if (!derivative_.status.ok()) return false;
    const HeldTogether held(preparation_.dynamics(k), run_.arcs[k], derivative_.options.tolerance);
    if (!held.Whole().ok()) return Refuse(held.Whole().message);
  }
  return true;
}

bool LinearRun::CheckArcs() {
  const ArcProduct carry = [this](std::size_t k, Matrix* columns) { arcs_[k].Forward(columns); };
  derivative_.status = preparation_.CheckTouchingContacts(derivative_, carry);
  if (!derivative_.status.ok()) return false;
  derivative_.time = preparation_.EndField();
  derivative_.status = preparation_.CheckLaw(carry, &derivative_);
  gradient_->event_law = derivative_.trust.event_law;
  if (!derivative_.status.ok()) return false;
  derivative_.status =
      CheckOrders(run_, preparation_.DynamicsOfArcs(), derivative_, carry, &state_error_);
  return derivative_.status.ok();
}

/// w behind the start.
Vector LinearRun::Start() const {
  Matrix w = Matrix::Zero(size(), 1);
  if (direction_->initial.size() > 0) w.col(0).head(d2_) = direction_->initial;
  if (direction_->parameters.size() > 0) w.col(0).tail(parameters_) = direction_->parameters;
  SetInput(0, &w);
  const Vector given = w;
  const Vector started = derivative_.start(given);
  if (!(started - given).isZero(0)) {
    throw NotPiecewiseLinear(
        "in this direction a contact is hit at the start, or its slip reversed: what follows has a "
        "derivative along the direction, and its gradient is not given");
  }
  return derivative_.start_stop(started, derivative_.start.Brushed(started));
}

/// The pieces of all events, those of the direction where there is one.
void LinearRun::FindPieces() {
  Matrix w = Matrix::Zero(size(), 1);
  if (direction_ != nullptr) w.col(0) = Start();
  Eigen::Index interval = 0;
  gradient_->modes = {derivative_.initial_mode};
  pieces_.reserve(run_.arcs.size() - 1);
  for (std::size_t k = 0; k + 1 < run_.arcs.size(); ++k) {
    AskBudget();
    if (direction_ != nullptr) arcs_[k].Forward(&w);
    pieces_.push_back(PieceOf(k, w.col(0)));
    const EventPiece& piece = pieces_.back();
    gradient_->modes.insert(gradient_->modes.end(), piece.modes.begin(), piece.modes.end());
    if (direction_ == nullptr) continue;
    if (piece.matrix.size() > 0) w = piece.matrix * w;
    if (run_.transitions[k].changes_input) SetInput(++interval, &w);
  }
}

void LinearRun::SetInput(Eigen::Index interval, Matrix* w) const {
  if (direction_->inputs.size() == 0 || inputs_ == 0) return;
  w->col(0).segment(d2_, inputs_) = Eigen::Map<const Matrix>(direction_->inputs.data(), inputs_,
                                                             direction_->inputs.size() / inputs_)
                                        .col(interval);
}

/// Its matrix is empty for the identity.
EventPiece LinearRun::PieceOf(std::size_t k, const VectorRef& w) const {
  const EventMap& event = derivative_.events[k];
  const Transition& transition = event.transition();
  const bool nothing = transition.changes_input && event.num_input_changes() == 0 &&
                       transition.mode_before == transition.mode_after &&
                       transition.guards.empty() && event.num_activations() == 0;
  if (event.absorbed() || nothing) return EventPiece();
  return event.PieceAlong(w);
}

}  // namespace contact_flow
