// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"

namespace contact_flow {

/// The reset (q, v) ↦ (q, v⁺) of contacts that would rise and be pressed back at once, and rest in
/// `mode` behind it (BringToRest), with its derivative. What the bounces leave out, as the motion
/// goes on between them, is of second order in their speeds.
struct RestReset {
  Vector v_plus;    ///< [d]
  Matrix jacobian;  ///< [2d+k × 2d+k]
};

RestReset ResetToRest(const ContactDynamics& dynamics, const Vector& x, ContactMode mode);

}  // namespace contact_flow
