// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// An interior minimum of a guard along an arc: the event that did not happen.
struct GuardDip {
  int constraint = 0;
  bool is_force =
      false;     ///< of a force λ_i [N], else of a gap a_i [m] (of its depth where it is pressed)
  double t = 0;  ///< [s]
  double value = 0;  ///< [N] or [m]
};

/// The minima of all guards of an arc, by constraint, then time. They are roots of the guard's rate
/// on the dense motion, told apart where it turns (ResolvedInstants); there are none without
/// SimulateOptions::dense. A gap below `gap_tolerance` at the begin [m] is leaving zero.
std::vector<GuardDip> FindGuardDips(const MechanicalSystem& system, const Arc& arc,
                                    double gap_tolerance);

}  // namespace contact_flow
