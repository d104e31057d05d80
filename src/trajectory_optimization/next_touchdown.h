// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A touchdown that a run ends before.
struct NextTouchdown {
  int constraint = 0;
  double after = 0;        ///< T [s]
  double rate = 0;         ///< of the gap there, < 0
  Eigen::RowVectorXd row;  ///< Da [1 × d]
};

/// The first of a rigid contact, by a_i + ȧ_i s + ½ Da_i v̇ s² = 0 at T: the nearer the better.
/// Nothing where the forces at T are not known.
std::optional<NextTouchdown> TouchdownBehind(const MechanicalSystem& system, const Trajectory& run);

/// Whether an event of a contact is within `interval` [s] of T, before it or behind.
bool IsMetAtEnd(const MechanicalSystem& system, const Trajectory& run, double interval);

}  // namespace contact_flow
