// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/flow/simulate.h"

namespace contact_flow {

/// Whether contact i, within its floor, comes down faster than what counts as rest, and is turned
/// back by its acceleration, so that no guard need tell that it touches: it does.
inline bool IsThrownDown(const GapSample& at, int i, double speed_tolerance) {
  const double rate = at.rate(i), opens = at.acceleration(i);
  return rate < -speed_tolerance && opens > 0 && at.gap(i) <= rate * rate / (2 * opens);
}

/// Whether one may be, of those that are open.
inline bool MayBeThrownDown(const GapSample& at, ContactMode mode, const SimulateOptions& options) {
  for (int i = 0; i < at.gap.size(); ++i) {
    const bool near = !mode.Contains(i) && std::abs(at.gap(i)) <= options.absolute_tolerance;
    if (near && IsThrownDown(at, i, options.speed_tolerance)) return true;
  }
  return false;
}

}  // namespace contact_flow
