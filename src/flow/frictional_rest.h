// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// How bounces that accumulate end, with friction: the contacts of the last of them rest,
///   A v⁺ = 0,      v⁺ = v + P Wᵀ p,      A of rows N, and T of those that stick,
/// W being N − μ d T of those that slip along d, else as A, and p the smallest. While they bounce
/// their forces are, on the whole, those of contact from the start on and p: what bounces is slow
/// by then, and the error of v⁺ is of the second order in its speed.
struct FrictionalRest {
  Vector v_plus;
  ConstraintSet closed;  ///< what rests
  ContactMode mode;      ///< with letters
  double energy_lost;    ///< [J]; a little below zero where friction is given back
};
/// From the velocities after the transition `last`, of the contacts `closed`, which come to rest;
/// those with |a| ≤ `gap_tolerance` that these imply rest, too. None where the letters are not
/// decided, or a slip in space would begin.
std::optional<FrictionalRest> RestOfBounces(ContactDynamics* dynamics, const Transition& last,
                                            ConstraintSet closed, double gap_tolerance);

}  // namespace contact_flow
