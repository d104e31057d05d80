// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/derivative/order_outcomes.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// Touchdowns with friction that coincide, at x⁻ and at states around it, one after the other in
/// every order, beside the same at once.
struct LandingOrders {
  std::vector<OrderOutcome> outcomes;  ///< at x⁻, their modes unknown
  double apart = 0;  ///< largest difference of a velocity at x⁻ from that of all at once
  /// No order leads elsewhere, at x⁻ and around it: the outcome is continuous, and the order of the
  /// touchdowns tells the piece of its derivative.
  bool agree = false;
};

/// Of a transition with at most kMaxOrderedLandings touchdowns.
LandingOrders FindLandingOrders(const MechanicalSystem& system, const Transition& transition);

inline constexpr int kMaxOrderedLandings = 5;

}  // namespace contact_flow
