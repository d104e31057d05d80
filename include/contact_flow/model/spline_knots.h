// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What a MechanicalSystem offers besides that follows splines, or stands on them. A cubic spline
/// has continuous second derivatives and third ones that jump at its knots: f is continuous there,
/// and its derivatives jump. That of the motion is the product of those before and behind, as at
/// EffortLimits. Integrators end a step there: one across a knot has errors of low order.
class SplineKnots {
 public:
  virtual ~SplineKnots() = default;

  /// From (q, v) to the next knot of a function of time [s]; infinity where none follows.
  virtual double TimeToKnot(const VectorRef& q, const VectorRef& v) const = 0;
  /// Coordinates of contacts across the surfaces that they touch: for each the values at which it
  /// has knots, ascending.
  virtual const std::vector<std::vector<double>>& knots_of_places() const = 0;
  /// Those coordinates at q, in the order of the knots; NaN where the contact is not in `mode`,
  /// since its surface pushes nothing then.
  virtual void Places(const VectorRef& q, const ContactMode& mode, Vector* place) const = 0;
};

}  // namespace contact_flow
