// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "contact_flow/trajectory_optimization/piece_models.h"

namespace contact_flow {

/// A point with the cost of its plain run.
struct FacePoint {
  Vector y;
  double cost = std::numeric_limits<double>::infinity();   ///< L; infinite where the run ends early
  double plain = std::numeric_limits<double>::infinity();  ///< J
  Vector values;                                           ///< of the conditions
  std::vector<int> met;                                    ///< how often each constraint is
  double violation = 0;                                    ///< largest of the conditions
  bool on_face = false;  ///< the events that were asked for coincide
};

/// Throws BudgetExceeded where the budget of this thread has ended a run, or its caller: such a
/// status says nothing of the point.
void CheckBudget(const Status& status);

/// The cost at y. Where `pairs` are given, their times apart are appended.
FacePoint Evaluate(const Unknowns& unknowns, const Multipliers& multipliers, const Vector& y,
                   const std::vector<OrderRow>& pairs, long* simulations, Vector* apart = nullptr);

/// y moved by the shortest step in the metric of the piece's H to where the events of these rows
/// coincide, by Newton's method with one derivative. Unknowns that are `bounded` stay.
FacePoint PutOntoFace(const Unknowns& unknowns, const Multipliers& multipliers,
                      const PieceModel& piece, const std::vector<int>& rows,
                      const std::vector<bool>& bounded, Vector y, long* simulations);

/// A touchdown at an instant of the grid.
struct Coincidence {
  EventName contact;
  int instant = 0;
};

/// Those of the pieces' faces closer than `interval` [s].
std::vector<Coincidence> CoincidencesAt(const PieceModels& models, double interval);

/// Adds the row of a touchdown at instant `to` of the grid; false where it does not happen.
bool AddFace(const Unknowns& unknowns, const Vector& y, const EventName& contact, int to,
             PieceModel* piece);

}  // namespace contact_flow
