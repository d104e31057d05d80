// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/types.h"

/// First-order analysis of a cost that is piecewise linear to first order, δJ = f(d), f: ℝⁿ → ℝ.
namespace contact_flow {

/// The direction in which a cost falls fastest.
struct SteepestDescent {
  Vector d;          ///< [n], |d|_∞ ≤ 1
  double slope = 0;  ///< f(d) ≤ 0; 0 at a first-order minimum
  int piece = -1;    ///< whose cone holds d
};

/// min f(d) over |d|_∞ ≤ 1: the least of the linear programs min g_i·d, C_i d ≥ 0. Without the
/// linear-programming library −g_i and its projections onto faces are tried.
SteepestDescent FindSteepestDescent(const PiecewiseLinearMap& cost);

/// Two pieces that meet in a face with different gradients, g_first − g_second = jump · normal.
struct Kink {
  int first = 0;    ///< index of a piece
  int second = 0;   ///< index of the one behind the face
  Vector normal;    ///< unit, into the cone of `first`
  double jump = 0;  ///< f(n) + f(−n) across the face: > 0 a valley (convex), < 0 a ridge (concave)

  /// Whether the cost rises from the kink to both sides.
  bool IsValley() const { return jump > 0; }
};

/// The faces at which f is kinked by more than `tolerance` times its largest gradient.
std::vector<Kink> FindKinks(const PiecewiseLinearMap& cost, double tolerance = 1e-7);

}  // namespace contact_flow
