// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/derivative/order_outcomes.h"
#include "contact_flow/flow/input_schedule.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// Where a run ends that goes on from the outcome of one order of impacts: the limit, as the
/// impacts draw together, of the runs that meet them in that order.
struct ContinuedOutcome {
  /// kOk, or why the run stopped early. kZeno too for an order that was cut
  /// (OrderOutcome::complete), which is not continued; kDiscontinuous when the continuation meets
  /// another cluster whose order decides: final_state is then what its simultaneous impact leads
  /// to, one limit of several.
  Status status;
  Vector final_state;              ///< x(T), or where the run stopped; empty if not begun [nq+d]
  std::vector<ContactMode> modes;  ///< passed through, the one after the impacts first
};

/// At most this many different outcomes of one cluster are continued.
inline constexpr int kMaxContinuedOutcomes = 1000;

/// Runs each of `outcomes`, the orders of `transition`, from (ρ, v⁺) up to time t_end [s] with the
/// inputs of the schedule from there on; one entry each. Orders that lead to the same (v⁺, J⁺) are
/// run once. The configuration is the located one, at which the gaps of a cluster vanish up to its
/// spread times their speeds: they are taken as closed. Throws std::length_error beyond
/// kMaxContinuedOutcomes different outcomes.
std::vector<ContinuedOutcome> ContinueOutcomes(const MechanicalSystem& system,
                                               const InputSchedule& schedule,
                                               const Transition& transition,
                                               const std::vector<OrderOutcome>& outcomes,
                                               double t_end, const SimulateOptions& options = {});

}  // namespace contact_flow
