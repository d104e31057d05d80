// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "contact_flow/analysis/validity_radius.h"

namespace contact_flow {

/// Changes below this part of their terms are rounding.
inline constexpr double kMarginNoise = 1e-9;

/// A margin that shrinks at `rate` for every unit of α reaches zero at margin/−rate.
inline void Consider(double margin, double rate, ValidityRadius::Limit limit, int constraint,
                     double t, ValidityRadius* smallest) {
  if (!(rate < 0)) return;
  const double radius = std::max(margin, 0.0) / -rate;
  if (radius < smallest->radius) *smallest = {radius, limit, constraint, t};
}

/// The speed with which a guard crosses zero. Where the crossing is about to vanish it does so like
/// √α, and its square like α.
inline void ConsiderFold(double speed, double change, ValidityRadius::Limit limit, int constraint,
                         double t, ValidityRadius* smallest) {
  Consider(speed * speed, 2 * speed * change, limit, constraint, t, smallest);
}

}  // namespace contact_flow
