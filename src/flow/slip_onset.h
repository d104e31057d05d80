// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <map>

#include "contact_flow/dynamics/word_selection.h"

namespace contact_flow {

/// Those of `still` that begin to slip in space by `word`.
ConstraintSet BeginInSpace(const MechanicalSystem& system, ConstraintSet still, ContactMode word);

/// The directions against the forces that hold `begins` in `mode` at x, in which they begin to slip
/// where these reach their cones. None where forces are shared, so that they do not tell.
std::map<int, Eigen::Vector2d> HeldDirections(ContactDynamics* dynamics, const Vector& x,
                                              ContactMode mode, ConstraintSet begins);

/// The directions in which the contacts `begins` in space begin to slip, where `word` was selected
/// for these touching contacts: y_t/|y_t| of (F4), which is simple at the border of the cone, too.
/// Where it is not unique, those of the smallest forces, of which `by` tells; FrictionRefusal where
/// nobody asks.
std::map<int, Eigen::Vector2d> OnsetDirections(ContactDynamics* dynamics, const Vector& x,
                                               const TouchingContacts& touching, ContactMode word,
                                               ConstraintSet begins, double border,
                                               WordConventions* by = nullptr);

/// Whether slips that begin in these directions from x on, where `rest` is what is still but for
/// them, speed up as the motion of `mode` goes on, and one that is alone turns back to its
/// direction when it is turned a little. Slips against forces that have reached their cones do,
/// unless normal forces change with them so much that they undo it; then that slip ends, or turns
/// away, at once.
bool SlipsGoOn(ContactDynamics* dynamics, Vector x, ContactMode mode, ContactMode rest,
               const std::map<int, Eigen::Vector2d>& directions, double speed);

}  // namespace contact_flow
