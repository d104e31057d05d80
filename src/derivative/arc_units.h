// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// Units in which the tangents of an arc are of one kind, whatever those of the system are: kinetic
/// ones for coordinates, y_i √M_ii, where the arc begins, and a time τ. The mass of what nothing
/// moves, as of a clock, means nothing: beside light bodies its unit would hide what it does to
/// them, and is theirs.
struct ArcUnits {
  Vector length;    ///< √M_ii [d]
  double time = 1;  ///< τ [s]
  Vector source;    ///< of the variables [k]: the largest entry of τ² √M S at a few places

  /// Those of an arc, but for the time.
  ArcUnits(const ContactDynamics& dynamics, const Arc& arc);
};

}  // namespace contact_flow
