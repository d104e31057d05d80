// SPDX-License-Identifier: BSD-3-Clause
#include "face.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "contact_flow/budget.h"
#include "piece_step.h"

namespace contact_flow {
namespace {

constexpr int kMaxNewton = 12;
/// Times apart that count as none, relative to 1 s: those of events are known to about 1e-14.
constexpr double kTogether = 2e-14;
/// … and that are good enough where Newton's method does not come closer.
constexpr double kClose = 1e-11;

/// How much longer runs are that are to meet at T what was not far from it, beside the times apart
/// and the horizon.
constexpr double kMoreApart = 2, kMoreHorizon = 1e-3;

/// The run beyond T where these pairs ask for a touchdown there, which may be behind it; else one
/// without arcs.
Trajectory BeyondEnd(const Unknowns& unknowns, const Vector& y, const std::vector<OrderRow>& pairs,
                     long* simulations) {
  const int end = static_cast<int>(unknowns.problem().inputs.grid.size());
  double beyond = 0;
  for (const OrderRow& pair : pairs) {
    const auto is_end = [&](const EventName& event) {
      return event.constraint < 0 && event.number == end;
    };
    if (!is_end(pair.first) && !is_end(pair.second)) continue;
    const double apart = kMoreApart * std::abs(pair.slack);
    beyond = std::max(beyond, apart + kMoreHorizon * unknowns.Horizon(y));
  }
  if (beyond == 0) return {};
  ++*simulations;
  return unknowns.RunBeyond(*unknowns.SystemAt(y), y,
                            unknowns.problem().simulate.simultaneity_tolerance, false, beyond);
}

}  // namespace

void CheckBudget(const Status& status) {
  if (status.ok()) return;
  std::string sentence;
  const BudgetEnd end = LookAtBudget(&sentence);
  if (end != BudgetEnd::kNone) throw BudgetExceeded(end, sentence);
  if (status.outcome == Outcome::kCancelled) {
    throw BudgetExceeded(BudgetEnd::kCancelled, status.message);
  }
}

FacePoint Evaluate(const Unknowns& unknowns, const Multipliers& multipliers, const Vector& y,
                   const std::vector<OrderRow>& pairs, long* simulations, Vector* apart) {
  AskBudget();
  ++*simulations;
  FacePoint point;
  point.y = y;
  try {
    const TrajectoryProblem& problem = unknowns.problem();
    const Trajectory run =
        unknowns.Run(y, problem.simulate.simultaneity_tolerance, unknowns.HasRunningCost());
    CheckBudget(run.status);
    if (!run.status.ok()) return point;
    point.met.resize(static_cast<std::size_t>(unknowns.system().num_constraints()), 0);
    for (const Transition& event : run.transitions) {
      for (int i : event.activated | event.switched) ++point.met[static_cast<std::size_t>(i)];
    }
    const std::vector<TrajectoryCondition>& conditions = unknowns.problem().conditions;
    const Matrix states = unknowns.States(run);
    point.plain = unknowns.Cost(y, run);
    point.values = ConditionValues(unknowns, run, states);
    if (!conditions.empty()) point.violation = Violations(conditions, point.values).maxCoeff();
    const double cost = point.plain + multipliers.Penalty(conditions, point.values);
    // A touchdown that is asked for and does not happen has no value.
    if (std::isfinite(cost) && point.values.allFinite()) point.cost = cost;
    if (apart != nullptr) {
      std::vector<double> grid = unknowns.Inputs(y).grid;
      const Trajectory longer = BeyondEnd(unknowns, y, pairs, simulations);
      if (!longer.arcs.empty()) grid.push_back(grid.front() + unknowns.Horizon(y));
      apart->resize(static_cast<Eigen::Index>(pairs.size()));
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        (*apart)(static_cast<Eigen::Index>(i)) =
            TimeBetween(longer.arcs.empty() ? run : longer, grid, pairs[i].first, pairs[i].second);
      }
    }
  } catch (const std::invalid_argument&) {  // a start that is none
  }
  return point;
}

FacePoint PutOntoFace(const Unknowns& unknowns, const Multipliers& multipliers,
                      const PieceModel& piece, const std::vector<int>& rows,
                      const std::vector<bool>& bounded, Vector y, long* simulations) {
  std::vector<OrderRow> pairs;
  Matrix A(static_cast<Eigen::Index>(rows.size()), y.size());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    pairs.push_back(piece.orders[static_cast<std::size_t>(rows[r])]);
    A.row(static_cast<Eigen::Index>(r)) = pairs.back().row;
  }
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    if (bounded[static_cast<std::size_t>(i)]) A.col(i).setZero();
  }
  Matrix reach = FactorOf(piece.hessian).solve(A.transpose());
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    if (bounded[static_cast<std::size_t>(i)]) reach.row(i).setZero();
  }
  const Eigen::CompleteOrthogonalDecomposition<Matrix> solver(A * reach);
  FacePoint best;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMaxNewton; ++i) {
    Vector apart;
    FacePoint point = Evaluate(unknowns, multipliers, y, pairs, simulations, &apart);
    if (!std::isfinite(point.cost) || !apart.allFinite()) break;
    const double largest = apart.cwiseAbs().maxCoeff();
    if (!(largest < least)) break;
    least = largest;
    best = point;
    best.on_face = largest <= kClose;
    if (largest <= kTogether) break;
    y = (y - reach * solver.solve(apart)).cwiseMax(unknowns.lower()).cwiseMin(unknowns.upper());
  }
  return best;
}

std::vector<Coincidence> CoincidencesAt(const PieceModels& models, double interval) {
  std::vector<Coincidence> found;
  for (const PieceModel& piece : models.pieces) {
    for (const OrderRow& row : piece.orders) {
      if (std::abs(row.slack) > 2 * interval) continue;
      if ((row.first.constraint < 0) == (row.second.constraint < 0)) continue;
      const bool input_first = row.first.constraint < 0;
      const Coincidence pair{input_first ? row.second : row.first,
                             input_first ? row.first.number : row.second.number};
      const bool known = std::any_of(found.begin(), found.end(), [&](const Coincidence& other) {
        return other.contact == pair.contact && other.instant == pair.instant;
      });
      if (!known) found.push_back(pair);
    }
  }
  return found;
}

bool AddFace(const Unknowns& unknowns, const Vector& y, const EventName& contact, int to,
             PieceModel* piece) {
  for (const EventTime& event : piece->times) {
    if (!(event.name == contact)) continue;
    OrderRow row;
    row.first = {-1, to};
    row.second = contact;
    const auto instant = static_cast<std::size_t>(to);
    row.slack = event.t - unknowns.Inputs(y).grid[instant];
    row.row = event.row - unknowns.InstantRow(instant);
    piece->orders.push_back(row);
    return true;
  }
  return false;
}

}  // namespace contact_flow
