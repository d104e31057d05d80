// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/flow/stage_places.h"

namespace contact_flow {

/// How low a guard comes on a step, by an interpolant of its own.
struct GuardBound {
  double lowest;  ///< a lower bound of the interpolant, by its Bernstein coefficients
  double error;   ///< an estimate of how far the guard is off the interpolant
  bool dips;      ///< whether the coefficients fall and rise again: else the interpolant does not
};

/// The quintic Hermite interpolant of both ends of a step of length h; its error is estimated by
/// the distance to the cubic one.
GuardBound QuinticBound(double h, const GuardJet& begin, const GuardJet& end);

/// Whether a guard stands so high above zero that nothing the ends of a step of length h know of
/// could bring it down: higher than kFarReach (h |ġ| + h² |g̈| / 2) at both. A sinusoid of any
/// frequency, phase and amplitude on top of a constant that is far has no zero.
bool IsFar(double h, const GuardJet& begin, const GuardJet& end);
inline constexpr double kFarReach = 4;

/// The cubic Hermite interpolant of a piece of length h, in Bernstein form.
struct CubicPiece {
  CubicPiece(double h, double g0, double r0, double g1, double r1)
      : b{g0, g0 + h * r0 / 3, g1 - h * r1 / 3, g1} {}
  double Value(double s) const;  ///< at s ∈ [0, 1]
  double Rate(double s) const;   ///< d/ds
  double Lowest() const;
  double Highest() const;
  /// Whether it turns once if its rates at the ends have opposite signs, and not at all otherwise.
  bool TurnsAsEndsTell() const;

  double b[4];
};

/// The quintic through the values of a guard at six places of a step; its error is estimated at
/// four others. `values` are those at the places, `stride` apart, and behind them those at the
/// probes if it was `probed`.
GuardBound StageBound(const StagePlaces& places, const double* values, int stride, bool probed);

}  // namespace contact_flow
