// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// What of an arc decides whether it may rest on a corner.
struct RestingQuestion {
  /// A step that lasts no longer is one in which a function passes its corner, or touches it where
  /// the arc begins or ends: what it tells of slopes is nothing [s].
  double instant = 0;
  /// Whether forces of contacts decide how the arc ends.
  bool forces = false;
  /// The changes of the input that matter, as the cone of these columns [m × ·]; all, where empty.
  Matrix inputs;
};

/// Not kOk where the motion stays on a corner of f throughout a step of the arc (CornerFunctions:
/// an effort at its limit, a place at the knot of its surface), and DF by the variables of
/// `dynamics` differs on its two sides in a direction that the mode admits: perturbed runs are on
/// one of them each. What the inputs that matter only move to the inner side of the limits has one
/// side, where DF right there is that of this side.
Status CheckRestingCorners(const ContactDynamics& dynamics, const Arc& arc,
                           const RestingQuestion& question);

}  // namespace contact_flow
