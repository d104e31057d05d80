// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What one order of the simultaneous activations leads to, in the limit of small separations.
struct OrderOutcome {
  std::vector<int> order;  ///< constraints in the order in which they are hit
  Vector v_plus;           ///< velocity after the last impact [d]
  ContactMode mode_after;  ///< contact mode then
  Vector impulse;          ///< summed impulses [n] [N·s]
  /// kOk; kZeno when contacts still approach after kMaxImpactsPerActivation impacts for each
  /// activation: the sequence is cut, v_plus is not where it ends; kFilippov when no one mode fits.
  Status status;
};

/// At most this many activations are permuted.
inline constexpr int kMaxOrderedActivations = 8;
/// Longest sequence of impacts that is followed, for each activation.
inline constexpr int kMaxImpactsPerActivation = 4;
/// At most this many orders are listed (8! is less).
inline constexpr std::size_t kMaxListedOrders = 50000;

/// The outcome of every order of impacts at the transition, under its law: from (ρ, v⁻), while a
/// constraint that is not yet in contact approaches, any of them may be hit next, alone with the
/// contacts that rest. A constraint that bounced or was lifted may be met again; one at rest whose
/// force would pull opens, by O(|w|²) only, takes no part in the next impact, and is met right
/// after it if that pushes it. Contacts that touch without force (Transition::touching) rest in the
/// first outcomes, and do not touch yet in those behind them, where they are hit like any other;
/// these are not listed where they are more than kMaxOrderedActivations with the activations.
/// Empty for more than kMaxOrderedActivations activations. A list of kMaxListedOrders entries
/// may lack others, and so may one of 2 for each order.
std::vector<OrderOutcome> ListOrderOutcomes(ContactDynamics* dynamics,
                                            const Transition& transition);

}  // namespace contact_flow
