// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// How bounces that accumulate end, with friction: the contacts of the last of them rest,
///   N v⁺ = 0,      T v⁺ = 0 of those that stick,      v⁺ = v + P Aᵀ p,
/// p being the smallest. What bounces is slow by then, and so is the error of v⁺.
struct FrictionalRest {
  Vector v_plus;
  ContactMode closed;  ///< what rests
  ContactMode mode;    ///< with letters
  double energy_lost;  ///< [J]
};
/// From the velocities after the transition `last`, of the contacts `closed`, which come to rest;
/// those with |a| ≤ `gap_tolerance` that these imply rest, too. None where the letters are not
/// decided, or a slip in space would begin.
std::optional<FrictionalRest> RestOfBounces(ContactDynamics* dynamics, const Transition& last,
                                            ContactMode closed, double gap_tolerance);

}  // namespace contact_flow
