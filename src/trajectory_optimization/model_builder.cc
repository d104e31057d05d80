// SPDX-License-Identifier: BSD-3-Clause
#include "model_builder.h"

#include <algorithm>
#include <sstream>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "next_touchdown.h"

namespace contact_flow {
namespace {

/// The orders of one event map that are pieces of their own; one where it is C¹, unless positions
/// are `asked` for at an instant among its events, before or behind an impact.
std::vector<std::vector<int>> Orders(const EventMap& event, double kink_tolerance, bool asked) {
  std::vector<int> order = event.activated();
  if (event.num_activations() < 2) return {order};
  if (!asked && event.IsDifferentiable(kink_tolerance)) return {order};
  std::vector<std::vector<int>> orders;
  do {
    bool right = true;  // changes of the input in their order
    int last = -1;
    for (int i : order) {
      if (!event.IsInputChange(i)) continue;
      right = right && i > last;
      last = i;
    }
    if (right) orders.push_back(order);
  } while (std::next_permutation(order.begin(), order.end()));
  return orders;
}

}  // namespace

ModelBuilder::ModelBuilder(const Unknowns& unknowns, const MechanicalSystem& system,
                           const Vector& y, const Multipliers& multipliers, const Trajectory& run,
                           const BDerivative& derivative)
    : unknowns_(unknowns),
      problem_(unknowns.problem()),
      system_(system),
      y_(y),
      multipliers_(multipliers),
      run_(run),
      derivative_(derivative),
      states_(unknowns.States(run)),
      inputs_(unknowns.Inputs(y)),
      values_(ConditionValues(unknowns, run, states_)),
      moves_(!problem_.choose_durations.empty()) {
  inputs_.grid.push_back(inputs_.grid.front() + unknowns.Horizon(y));
  inputs_.values.push_back(Vector(inputs_.values.back()));
  std::size_t passed = 0;
  for (const EventMap& event : derivative.events) {
    if (event.absorbed()) {
      orders_.push_back(std::vector<std::vector<int>>{{}});
      continue;
    }
    bool asked = false;
    for (int i = 0; i < event.num_input_changes(); ++i) asked = Asks(passed++) || asked;
    if (event.num_input_changes() == 0 && event.transition().changes_input) ++passed;
    asked = asked && !system_.HasFriction();  // steps are not kept in order
    orders_.push_back(Orders(event, derivative.options.kink_tolerance, asked));
  }
  beyond_ = passed == problem_.inputs.grid.size();
}

std::size_t ModelBuilder::Count() const {
  std::size_t count = 1;
  for (const auto& orders : orders_) {
    count = std::min<std::size_t>(count * orders.size(), 1000000);
  }
  return count;
}

bool ModelBuilder::Build(std::size_t number, PieceModel* model, Status* status) {
  const int n = unknowns_.size();
  Matrix W = FirstTangents();
  model->gradient = Vector::Zero(n);
  model->hessian = Matrix::Zero(n, n);
  model->conditions = Matrix::Zero(static_cast<Eigen::Index>(problem_.conditions.size()), n);
  AddEffort(model);
  events_.clear();
  occurrences_.clear();
  std::size_t interval = 0, passed = 0;
  for (std::size_t k = 0; k < derivative_.arcs.size(); ++k) {
    AskBudget();
    AddSlipCurvature(k, false, W, model);
    W = (derivative_.arcs[k] * W).eval();
    AddSlipCurvature(k, true, W, model);
    if (k == derivative_.events.size()) break;
    const EventMap& event = derivative_.events[k];
    const std::vector<int>& order = orders_[k][number % orders_[k].size()];
    if (orders_[k].size() > 1) AddLabel(event, order, model);
    number /= orders_[k].size();
    if (!event.absorbed() && !PassEvent(k, order, &passed, &W, model, status)) return false;
    if (run_.transitions[k].changes_input) {
      AddInput(++interval);
      if (interval < problem_.inputs.grid.size()) SetInput(interval, &W);
    }
  }
  if (!beyond_) AddEnd(W, model);
  model->times = events_;
  if (!beyond_) AddNext(W);
  AddOrders(model);
  events_ = model->times;
  return AddTouchdowns(model, status) && AddRunning(model, status);
}

double ModelBuilder::Cost() const {
  return unknowns_.Cost(y_, run_) + multipliers_.Penalty(problem_.conditions, values_);
}

std::vector<std::string> ModelBuilder::Clusters() const {
  std::vector<std::string> clusters;
  const auto& names = system_.description().constraints;
  for (std::size_t k = 0; k < orders_.size(); ++k) {
    if (orders_[k].size() < 2) continue;
    const EventMap& event = derivative_.events[k];
    std::ostringstream text;
    text.precision(9);
    text << event.ActivatedConstraints().ToString(names);
    if (event.num_input_changes() > 0) text << " and the input";
    text << " at t = " << event.time() << " s";
    clusters.push_back(text.str());
  }
  return clusters;
}

Matrix ModelBuilder::FirstTangents() const {
  const int d2 = 2 * system_.dof(), m = system_.num_inputs();
  Matrix W = Matrix::Zero(derivative_.arcs.front().rows(), unknowns_.size());
  for (std::size_t i = 0; i < problem_.choose_initial.size(); ++i) {
    W(problem_.choose_initial[i], unknowns_.Initial(i)) += 1;
  }
  for (std::size_t i = 0; i < problem_.choose_parameters.size(); ++i) {
    W(d2 + m + static_cast<Eigen::Index>(i), unknowns_.Parameter(i)) = 1;
  }
  SetInput(0, &W);
  return W;
}

void ModelBuilder::SetInput(std::size_t interval, Matrix* W) const {
  W->middleRows(2 * system_.dof(), system_.num_inputs()) = unknowns_.InputRows(y_, interval);
}

/// F at the begin or the end of an arc [2d].
Vector ModelBuilder::FieldAt(std::size_t arc, bool end) const {
  const Arc& at = run_.arcs[arc];
  ContactDynamics dynamics(system_, at.u);
  return dynamics.Field(end ? at.x_end : at.x_begin, at.mode).head(2 * system_.dof());
}

/// An instant of the grid away from events of contacts.
void ModelBuilder::PassChange(std::size_t k, std::size_t* passed, Matrix* W, PieceModel* model) {
  if (!moves_) return AddState((*passed)++, *W, model);
  const Eigen::RowVectorXd shift = unknowns_.InstantRow(*passed + 1);
  W->topRows(2 * system_.dof()) += FieldAt(k, true) * shift;
  AddState((*passed)++, *W, model);
  W->topRows(2 * system_.dof()) -= FieldAt(k + 1, false) * shift;
}

/// Transition k. The instants of the grid in a cluster move together, if at all: then what is
/// before it happens to W + F⁻ δt, and what is left is that less F⁺ δt.
bool ModelBuilder::PassEvent(std::size_t k, const std::vector<int>& order, std::size_t* passed,
                             Matrix* W, PieceModel* model, Status* status) {
  const EventMap& event = derivative_.events[k];
  const int d2 = 2 * system_.dof();
  const Matrix selection = event.Selection(order).topRows(d2);
  if (event.num_input_changes() == 0) {
    if (!AddImpulses(k, order, *passed, *W, model, status)) return false;
    AddEvents(k, order, 0, *W, Eigen::RowVectorXd::Zero(W->cols()));
    if (order.empty() && system_.HasFriction()) AddLandings(k, *W);
    W->topRows(d2) = (selection * *W).eval();
    if (event.transition().changes_input) PassChange(k, passed, W, model);
    return true;
  }
  Eigen::RowVectorXd shift = Eigen::RowVectorXd::Zero(W->cols());
  if (moves_) {
    if (event.num_input_changes() > 1) {
      *status = {Outcome::kNotDifferentiable,
                 "two instants of the grid that may move coincide with an event of a contact"};
      return false;
    }
    shift = unknowns_.InstantRow(*passed + 1);
    W->topRows(d2) += FieldAt(k, true) * shift;
  }
  if (!AddImpulses(k, order, *passed, *W, model, status)) return false;
  AddEvents(k, order, *passed + 1, *W, shift);
  const Matrix before = *W;
  W->topRows(d2) = (selection * *W).eval();
  if (!AddCluster(event, order, before, *W, passed, model, status)) return false;
  if (!moves_) return true;
  std::size_t last = k;
  while (last + 1 < derivative_.events.size() && derivative_.events[last + 1].absorbed()) ++last;
  W->topRows(d2) -= FieldAt(last + 1, false) * shift;
  return true;
}

/// The states at the instants of the grid that belong to this event: those before it in the
/// order are met with the tangents before, those behind it with the tangents after it.
bool ModelBuilder::AddCluster(const EventMap& event, const std::vector<int>& order,
                              const Matrix& before, const Matrix& after, std::size_t* passed,
                              PieceModel* model, Status* status) const {
  const auto changes = static_cast<std::size_t>(event.num_input_changes());
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (!event.IsInputChange(order[i])) continue;
    const std::size_t at = (*passed)++;
    const std::string jump = AskedJump(at, event);
    if (!jump.empty()) {
      *status = {Outcome::kNotDifferentiable,
                 jump + " is not continuous where " +
                     event.ActivatedConstraints().ToString(system_.description().constraints) +
                     " is met at the same instant"};
      return false;
    }
    const bool first = i < changes && event.IsInputChange(order[0]);
    const bool last = i + changes >= order.size() && event.IsInputChange(order.back());
    const bool between = !first && !last;
    if (between && (Asks(at) || !problem_.conditions.empty())) {
      *status = {Outcome::kNotDifferentiable,
                 "a cost of positions on the way is not differentiated where the input changes "
                 "between two simultaneous touchdowns"};
      return false;
    }
    AddState(at, first ? before : after, model);
  }
  return true;
}

/// The state at T, an instant like those of the grid.
void ModelBuilder::AddEnd(const Matrix& W, PieceModel* model) {
  const std::size_t count = problem_.inputs.grid.size();
  Matrix at_end = W;
  if (moves_) {
    at_end.topRows(2 * system_.dof()) +=
        FieldAt(run_.arcs.size() - 1, true) * unknowns_.InstantRow(count);
  }
  AddState(count - 1, at_end, model);
  AddInput(count);
}

/// The touchdown that would come next behind T, as the state there tells; W is that at fixed T.
void ModelBuilder::AddNext(const Matrix& W) {
  const std::optional<NextTouchdown> next = TouchdownBehind(system_, run_);
  if (!next || next->after > unknowns_.Length(y_, problem_.inputs.grid.size() - 1)) return;
  const auto d = static_cast<Eigen::Index>(system_.dof());
  EventTime timed;
  timed.name = {next->constraint, occurrences_[next->constraint]};
  timed.t = run_.t_end() + next->after;
  timed.row = next->row * (W.topRows(d) + next->after * W.middleRows(d, d)) / -next->rate;
  events_.push_back(timed);
}

/// Where inputs are led linearly they only turn at an instant: events pass it without a kink,
/// unless the state there is asked for.
void ModelBuilder::AddInput(std::size_t interval) {
  if (problem_.linear_inputs && !Asks(interval - 1)) return;
  EventTime event;
  event.name = {-1, static_cast<int>(interval)};
  event.t = inputs_.grid[interval];
  // Inside a cluster it has its place already.
  for (const EventTime& other : events_) {
    if (other.name == event.name) return;
  }
  event.row = unknowns_.InstantRow(interval);
  events_.push_back(event);
}

void ModelBuilder::AddLabel(const EventMap& event, const std::vector<int>& order,
                            PieceModel* model) const {
  const auto& names = system_.description().constraints;
  if (!model->label.empty()) model->label += "; ";
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i > 0) model->label += ", ";
    model->label +=
        event.IsInputChange(order[i]) ? "input change" : names[static_cast<std::size_t>(order[i])];
  }
}

/// The events of transition k with their times, as they come in this order; `instant` of the grid
/// is the first among them.
void ModelBuilder::AddEvents(std::size_t k, const std::vector<int>& order, std::size_t instant,
                             const Matrix& W, const Eigen::RowVectorXd& shift) {
  if (order.empty()) return;
  const EventMap& event = derivative_.events[k];
  const Matrix times = event.Times(order) * W;
  for (std::size_t i = 0; i < order.size(); ++i) {
    EventTime timed;
    double offset = 0;
    for (const EventInstant& known : event.transition().instants) {
      if (known.constraint == order[i]) offset = known.offset;
    }
    timed.t = event.time() + offset;
    timed.row = times.row(static_cast<Eigen::Index>(i)) + shift;
    if (orders_[k].size() == 1) timed.smooth = static_cast<int>(k);
    if (event.IsInputChange(order[i])) {
      timed.name = {-1, static_cast<int>(instant)};
      timed.t = inputs_.grid[instant++];
      if (problem_.linear_inputs && !Asks(instant - 2)) continue;
    } else {
      timed.name = {order[i], occurrences_[order[i]]++};
    }
    events_.push_back(timed);
  }
}

/// The touchdowns of transition k, with friction: those whose instants its one piece knows.
void ModelBuilder::AddLandings(std::size_t k, const Matrix& W) {
  const EventMap& event = derivative_.events[k];
  ConstraintSet left = event.transition().activated;
  for (const PieceTimes& piece : event.TimesOfPieces(1)) {
    for (std::size_t i = 0; i < piece.constraints.size(); ++i) {
      const int constraint = piece.constraints[i];
      if (!left.Contains(constraint)) continue;
      left.Erase(constraint);
      EventTime timed;
      timed.name = {constraint, occurrences_[constraint]++};
      timed.t = event.time();
      timed.row = piece.times.row(static_cast<Eigen::Index>(i)) * W;
      events_.push_back(timed);
    }
    break;
  }
  for (int constraint : left) ++occurrences_[constraint];
}

/// Successive events stay in their order, but for changes of the input, which do so anyway, and
/// those of one cluster that is C¹, and, at T, where the cost jumps: that is no kink to go along.
/// With friction steps are not kept in order: what coincides there
/// is differentiated where it has one piece alone.
void ModelBuilder::AddOrders(PieceModel* model) const {
  if (system_.HasFriction()) return;
  const EventName end{-1, static_cast<int>(problem_.inputs.grid.size())};
  const ConstraintSet jumping = JumpingAtEnd();
  for (std::size_t i = 0; i + 1 < events_.size(); ++i) {
    const EventTime &first = events_[i], &second = events_[i + 1];
    if (first.name.constraint < 0 && second.name.constraint < 0) continue;
    if (first.smooth >= 0 && first.smooth == second.smooth) continue;
    if (first.name == end && jumping.Contains(second.name.constraint)) continue;
    if (second.name == end && jumping.Contains(first.name.constraint)) continue;
    OrderRow row;
    row.first = first.name;
    row.second = second.name;
    row.slack = second.t - first.t;
    row.row = second.row - first.row;
    if (row.row.norm() > 0) model->orders.push_back(row);
  }
}

}  // namespace contact_flow
