// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "contact_flow/flow/status.h"
#include "contact_flow/trajectory_optimization/merit.h"
#include "contact_flow/trajectory_optimization/problem.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// An event of a run by what stays the same when the run changes a little.
struct EventName {
  int constraint = -1;  ///< that is met, or −1: the input changes
  int number = 0;  ///< its times so far; for an input the instant of the grid, 1 … K, the end
  /// Same event.
  bool operator==(const EventName& o) const {
    return constraint == o.constraint && number == o.number;
  }
};

/// `second` comes after `first` in a piece: slack + row·d ≥ 0, both times [s].
struct OrderRow {
  EventName first;         ///< the earlier one
  EventName second;        ///< the later one
  double slack = 0;        ///< t_second − t_first
  Eigen::RowVectorXd row;  ///< its change with the unknowns [1 × n]
};

/// When an event happens, to first order.
struct EventTime {
  EventName name;          ///< which
  double t = 0;            ///< [s]
  Eigen::RowVectorXd row;  ///< its change with the unknowns [1 × n]
  int smooth = -1;         ///< index of the cluster that it belongs to, if that is C¹
};

/// The cost and the order of events on one piece of the outcome, to first order; the second order
/// is that of Gauss and Newton,
///   J(y + d) ≈ J + gᵀd + ½ dᵀ H d,    H = 2 KᵀK,  K the derivative of the residuals.
struct PieceModel {
  Vector gradient;               ///< g [n]
  Matrix hessian;                ///< H [n × n]
  Matrix conditions;             ///< derivative of the conditions' c [· × n]
  std::vector<OrderRow> orders;  ///< where it holds
  std::vector<EventTime> times;  ///< of all its events, in their order
  std::string label;             ///< the orders of its clusters, "input change, floor"
};

/// A cost at a point with the models of all its pieces there.
struct PieceModels {
  Status status;    ///< not kOk: there is no derivative, and why; the cost may be there
  double cost = 0;  ///< J
  std::vector<PieceModel> pieces;     ///< that meet here
  std::vector<std::string> clusters;  ///< "floor and input change at t = 0.7 s", those with pieces
};

/// The models at y, events within the problem's kink_interval taken as one. More than `max_pieces`
/// are refused by status, and so is a start from which not every direction is admitted. Where
/// `multipliers` are given J is L (Multipliers).
PieceModels MakePieceModels(const Unknowns& unknowns, const Vector& y, std::size_t max_pieces = 720,
                            const Multipliers& multipliers = {});

/// When a constraint is met in a run [s]; NaN where it is not.
double TimeOf(const Trajectory& run, const EventName& event);

/// t_second − t_first of events in a run with this grid, or with T behind it [s]; NaN where one
/// does not happen.
double TimeBetween(const Trajectory& run, const std::vector<double>& grid, const EventName& first,
                   const EventName& second);

/// "touchdown 1 of 'floor'", "the input change at t = 0.7 s" or "the end",
/// in a run with this grid.
std::string Describe(const Unknowns& unknowns, const std::vector<double>& grid,
                     const EventName& event);

}  // namespace contact_flow
