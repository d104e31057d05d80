// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// One instant of a motion, with what can be told of it alone.
struct Instant {
  double t = 0;         ///< [s]
  Vector x;             ///< (q, v) [nq+d]
  Vector u;             ///< in force from now on [m]
  Vector force;         ///< λ [n+l+r]
  Vector acceleration;  ///< v̇ [d]
  ContactMode mode;
};

}  // namespace contact_flow
