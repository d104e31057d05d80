// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/piece_models.h"

#include <algorithm>
#include <map>
#include <sstream>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

/// The orders of one event map that are pieces of their own; one where it is C¹.
std::vector<std::vector<int>> Orders(const EventMap& event, double kink_tolerance) {
  std::vector<int> order = event.activated();
  if (event.num_activations() < 2 || event.IsDifferentiable(kink_tolerance)) return {order};
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

/// The run with its derivative, from which the model of each choice of orders is built.
class ModelBuilder {
 public:
  ModelBuilder(const Unknowns& unknowns, const Vector& y, const Trajectory& run,
               const BDerivative& derivative)
      : unknowns_(unknowns),
        problem_(unknowns.problem()),
        system_(unknowns.system()),
        y_(y),
        run_(run),
        derivative_(derivative),
        positions_(unknowns.Positions(run)) {
    for (const EventMap& event : derivative.events) {
      const bool plain = event.absorbed();
      orders_.push_back(plain ? std::vector<std::vector<int>>{{}}
                              : Orders(event, derivative.options.kink_tolerance));
    }
  }

  std::size_t Count() const {
    std::size_t count = 1;
    for (const auto& orders : orders_) {
      count = std::min<std::size_t>(count * orders.size(), 1000000);
    }
    return count;
  }

  /// The model of choice `number`, mixed radix in the orders; false with a status.
  bool Build(std::size_t number, PieceModel* model, Status* status) {
    const int n = unknowns_.size(), d2 = 2 * system_.dof();
    const Eigen::Index m = system_.num_inputs();
    Matrix S = Matrix::Zero(d2, n);
    for (std::size_t i = 0; i < problem_.choose_initial.size(); ++i) {
      S(problem_.choose_initial[i], unknowns_.Initial(i)) += 1;
    }
    model->gradient = Vector::Zero(n);
    model->hessian = Matrix::Zero(n, n);
    AddEffort(model);
    events_.clear();
    occurrences_.clear();
    std::size_t interval = 0, passed = 0;
    AddInput(0);
    for (std::size_t k = 0; k < derivative_.arcs.size(); ++k) {
      AskBudget();
      const Matrix& Phi = derivative_.arcs[k];
      S = (Phi.topLeftCorner(d2, d2) * S).eval();
      for (Eigen::Index j = 0; j < m; ++j) {
        const int place = unknowns_.Input(interval, static_cast<int>(j));
        if (place >= 0) S.col(place) += Phi.block(0, d2 + j, d2, 1);
      }
      if (k == derivative_.events.size()) break;
      const EventMap& event = derivative_.events[k];
      const std::vector<int>& order = orders_[k][number % orders_[k].size()];
      if (orders_[k].size() > 1) AddLabel(event, order, model);
      number /= orders_[k].size();
      if (!event.absorbed()) {
        const Matrix before = S;
        AddEvents(k, order, S);
        S = (event.Selection(order).topLeftCorner(d2, d2) * S).eval();
        if (unknowns_.HasPathCost() && !AddPath(event, order, before, S, &passed, model, status)) {
          return false;
        }
      }
      if (run_.transitions[k].changes_input) AddInput(++interval);
    }
    if (unknowns_.HasPathCost()) AddPosition(passed, S, model);
    AddTerminal(S, model);
    AddOrders(model);
    model->times = events_;
    return true;
  }

  double Cost() const { return unknowns_.Cost(y_, positions_, run_.FinalState()); }

  std::vector<std::string> Clusters() const {
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

 private:
  void AddInput(std::size_t interval) {
    if (interval == 0) return;
    EventTime event;
    event.name = {-1, static_cast<int>(interval)};
    event.t = problem_.inputs.grid[interval];
    // Inside a cluster it has its place already.
    for (const EventTime& other : events_) {
      if (other.name == event.name) return;
    }
    event.row = Eigen::RowVectorXd::Zero(unknowns_.size());
    events_.push_back(event);
  }

  void AddLabel(const EventMap& event, const std::vector<int>& order, PieceModel* model) const {
    const auto& names = system_.description().constraints;
    if (!model->label.empty()) model->label += "; ";
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (i > 0) model->label += ", ";
      model->label += event.IsInputChange(order[i]) ? "input change"
                                                    : names[static_cast<std::size_t>(order[i])];
    }
  }

  /// The events of transition k with their times, as they come in this order.
  void AddEvents(std::size_t k, const std::vector<int>& order, const Matrix& S) {
    if (order.empty()) return;
    const EventMap& event = derivative_.events[k];
    const Matrix times = event.Times(order).leftCols(S.rows()) * S;
    int instant = 1;  // of the grid
    for (std::size_t i = 0; i < k; ++i) instant += run_.transitions[i].changes_input;
    for (std::size_t i = 0; i < order.size(); ++i) {
      EventTime timed;
      double offset = 0;
      for (const EventInstant& known : event.transition().instants) {
        if (known.constraint == order[i]) offset = known.offset;
      }
      timed.t = event.time() + offset;
      timed.row = times.row(static_cast<Eigen::Index>(i));
      if (orders_[k].size() == 1) timed.smooth = static_cast<int>(k);
      if (event.IsInputChange(order[i])) {
        timed.name = {-1, instant++};
        timed.t = problem_.inputs.grid[static_cast<std::size_t>(timed.name.number)];
      } else {
        timed.name = {order[i], occurrences_[order[i]]++};
      }
      events_.push_back(timed);
    }
  }

  /// Successive events stay in their order, but for changes of the input, which do so anyway, and
  /// those of one cluster that is C¹.
  void AddOrders(PieceModel* model) const {
    for (std::size_t i = 0; i + 1 < events_.size(); ++i) {
      const EventTime &first = events_[i], &second = events_[i + 1];
      if (first.name.constraint < 0 && second.name.constraint < 0) continue;
      if (first.smooth >= 0 && first.smooth == second.smooth) continue;
      OrderRow row;
      row.first = first.name;
      row.second = second.name;
      row.slack = second.t - first.t;
      row.row = second.row - first.row;
      if (row.row.norm() > 0) model->orders.push_back(row);
    }
  }

  void AddEffort(PieceModel* model) const {
    if (!problem_.choose_inputs) return;
    for (std::size_t k = 0; k < problem_.inputs.grid.size(); ++k) {
      for (Eigen::Index j = 0; j < problem_.effort.size(); ++j) {
        const int place = unknowns_.Input(k, static_cast<int>(j));
        const double reference =
            problem_.input_reference.size() > 0 ? problem_.input_reference(j) : 0;
        const double weight = 2 * unknowns_.Length(k) * problem_.effort(j);
        model->gradient(place) += weight * (y_(place) - reference);
        model->hessian(place, place) += weight;
      }
    }
  }

  /// Adds Σ w_i (value_i − goal_i)² with the derivative D of the value.
  static void AddSquares(const Vector& weight, const Vector& error, const Matrix& D,
                         PieceModel* model) {
    const Matrix weighted = weight.asDiagonal() * D;
    model->gradient += 2 * weighted.transpose() * error;
    model->hessian.noalias() += 2 * weighted.transpose() * D;
  }

  /// The derivative of coordinates q by tangents.
  Matrix PositionRates(const Vector& q) const {
    const int d = system_.dof(), nq = system_.num_positions();
    Matrix rates(nq, d);
    Vector rate(nq);
    for (int j = 0; j < d; ++j) {
      const Vector unit = Vector::Unit(d, j);
      system_.space().Rate(q.data(), unit.data(), rate.data());
      rates.col(j) = rate;
    }
    return rates;
  }

  void AddTerminal(const Matrix& S, PieceModel* model) const {
    const Vector& x = run_.FinalState();
    const int d = system_.dof(), nq = system_.num_positions();
    Matrix D(nq + d, S.cols());
    D << PositionRates(x.head(nq)) * S.topRows(d), S.bottomRows(d);
    AddSquares(problem_.weight, x - problem_.target, D, model);
  }

  void AddPosition(std::size_t k, const Matrix& S, PieceModel* model) const {
    const Vector q = positions_.col(static_cast<Eigen::Index>(k));
    Vector error = q;
    if (problem_.path_target.size() > 0) error -= problem_.path_target;
    AddSquares(unknowns_.Length(k) * problem_.path_weight, error,
               PositionRates(q) * S.topRows(system_.dof()), model);
  }

  /// The positions at the instants of the grid that belong to this event: those before it in the
  /// order are met with the tangents before, those behind it with the tangents after it.
  bool AddPath(const EventMap& event, const std::vector<int>& order, const Matrix& before,
               const Matrix& after, std::size_t* passed, PieceModel* model, Status* status) const {
    if (event.num_input_changes() == 0) {
      if (event.transition().changes_input) AddPosition((*passed)++, after, model);
      return true;
    }
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (!event.IsInputChange(order[i])) continue;
      const std::size_t changes = static_cast<std::size_t>(event.num_input_changes());
      const bool first = i < changes && event.IsInputChange(order[0]);
      const bool last = i + changes >= order.size() && event.IsInputChange(order.back());
      if (!first && !last) {
        *status = {Outcome::kNotDifferentiable,
                   "a cost of positions on the way is not differentiated where the input changes "
                   "between two simultaneous touchdowns"};
        return false;
      }
      AddPosition((*passed)++, first ? before : after, model);
    }
    return true;
  }

  const Unknowns& unknowns_;
  const TrajectoryProblem& problem_;
  const MechanicalSystem& system_;
  const Vector& y_;
  const Trajectory& run_;
  const BDerivative& derivative_;
  const Matrix positions_;
  std::vector<std::vector<std::vector<int>>> orders_;  // of each event map
  std::vector<EventTime> events_;
  std::map<int, int> occurrences_;
};

}  // namespace

PieceModels MakePieceModels(const Unknowns& unknowns, const Vector& y, std::size_t max_pieces) {
  PieceModels models;
  const TrajectoryProblem& problem = unknowns.problem();
  const Trajectory run = unknowns.Run(
      y, std::max(problem.kink_interval, problem.simulate.simultaneity_tolerance), true);
  models.status = run.status;
  if (!run.status.ok()) return models;
  BDerivativeOptions options = problem.derivative;
  options.variables = {};
  options.variables.inputs = true;
  const BDerivative derivative = DifferentiateOutcome(unknowns.system(), run, options);
  models.status = derivative.PiecewiseLinear();
  if (!models.status.ok()) return models;
  if (!derivative.start.Empty() || !derivative.start_stop.Empty()) {
    models.status = {Outcome::kNotDifferentiable,
                     "the run starts where contacts touch: not all directions are admitted"};
    return models;
  }
  if (unknowns.system().HasFriction()) {
    models.status = {Outcome::kNotDifferentiable,
                     "contacts have friction: their pieces are not orders of events"};
    return models;
  }
  for (const EventMap& event : derivative.events) {
    if (event.num_activations() <= options.max_activations_for_pieces) continue;
    models.status = {Outcome::kTooManyPieces,
                     std::to_string(event.num_activations()) + " events coincide at t = " +
                         std::to_string(event.time()) + " s: pieces are made of at most " +
                         std::to_string(options.max_activations_for_pieces)};
    return models;
  }
  ModelBuilder builder(unknowns, y, run, derivative);
  models.cost = builder.Cost();
  if (builder.Count() > max_pieces) {
    models.status = {Outcome::kTooManyPieces, "the cost has " + std::to_string(builder.Count()) +
                                                  " pieces: at most " +
                                                  std::to_string(max_pieces) + " are taken"};
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

}  // namespace contact_flow
