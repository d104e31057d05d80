// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// One way through a cluster of events with friction: what happens to every w in its cone.
struct FrictionalPath {
  Matrix matrix;                   ///< Ξ [2d+k × 2d+k]
  Matrix by_instants;              ///< by δt, of c changes of the input [2d+k × c]
  Matrix cone;                     ///< decisions: rows with cone·w ≥ 0 [· × 2d+k]
  std::vector<int> guards;         ///< constraints, or n + c, in the order in which they vanish
  std::vector<ContactMode> modes;  ///< after each of them
  std::vector<Vector> velocities;  ///< v after each of them, at the base point [d]
  Matrix times;                    ///< first-order changes of their instants, a row each
  Matrix times_by_instants;        ///< … by δt
  Vector v_plus;                   ///< velocity behind them, at the base point [d]
};

/// Follows the run perturbed along w through a cluster, from guard to guard, in the order of their
/// first-order instants:
///
///   w ← w + F τ,  τ = −Dh w / (Dh F)      of the guard h that vanishes first, in the present word,
///   w ← R'(w)                             (F6) at a touchdown, on the branch that w chooses,
///   next word by (F4), a contact whose slip is zero at the base point going the way of D(T v) w,
///   w ← w − F⁺ τ.
///
/// Slip onset, release from slip and the cone's apex are identities. Guards with a jump of the
/// field are touchdowns, stops and reversals, and releases without slip (μ = ∞). Where such a jump
/// follows, what has no force left keeps its place among the events, too: an impact finds it where
/// it was, hit or not, and a force that jumps, up or away. A contact that sticks and that w moves,
/// D(T v) w ≠ 0, begins to slip and is stopped at once, by the projection (F7). Changes of the
/// input, `inputs` being those from there on, have instants that move by `dt` alone, and the next
/// word is that of the new forces. Throws std::domain_error, or FrictionRefusal, where the
/// perturbed run is not decided: also where a contact that has let go would be pulled back and
/// touch again. `dynamics` is scratch.
FrictionalPath WalkThrough(ContactDynamics* dynamics, const Transition& transition,
                           const std::vector<Vector>& inputs, const VectorRef& w,
                           const VectorRef& dt);

}  // namespace contact_flow
