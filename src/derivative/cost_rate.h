// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/derivative/run_cost.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// l at an instant; 0 for a cost without one.
inline double RateOf(const RunCost& cost, double t, const Vector& x, const Vector& u,
                     ContactMode mode) {
  if (!cost.HasRate()) return 0;
  CostRate rate;
  rate.by_state = Vector::Zero(x.size());
  rate.by_input = Vector::Zero(u.size());
  cost.Rate(t, x, u, mode, &rate);
  return rate.value;
}

/// ∫ l dt along an arc so short that its ends tell it.
inline double ShortCost(const RunCost& cost, const Arc& arc) {
  return (arc.t_end - arc.t_begin) / 2 *
         (RateOf(cost, arc.t_begin, arc.x_begin, arc.u, arc.mode) +
          RateOf(cost, arc.t_end, arc.x_end, arc.u, arc.mode));
}

}  // namespace contact_flow
