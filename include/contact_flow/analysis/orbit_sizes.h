// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/analysis/poincare.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// How large a motion is, in the units of its system: what is small beside it is small in any.
struct OrbitSizes {
  /// Of (δq, δv) [2d]. Of a velocity the largest |v_i| at both ends of every arc, of a coordinate
  /// that times the duration. A velocity is at least a hundredth of what it would be if it had all
  /// of the kinetic energy, |v_i| = |v|_M / √M_ii; where nothing moves each size is 1.
  Vector tangent;
  double time = 1;  ///< duration of the motion [s]
  /// Of (δq, δv) where little moves, by where it is [2d]: |q_i|, at least a hundredth of the same
  /// of the coordinate with the largest √M_jj |q_j|; of a velocity that over the duration. A
  /// configuration that is no vector has 1 and 1/duration.
  Vector place;

  /// Of a function with this gradient by (δq, δv) [2d]: Σ |g_i| tangent_i, or 1 where that is none.
  double Of(const VectorRef& gradient) const;
  /// The larger of both for each of (δq, δv) [2d].
  Vector Larger() const { return tangent.cwiseMax(place); }
  /// The largest |δ_i| beside Larger(), δ [2d].
  double Compare(const VectorRef& difference) const;
};

/// Those of a run.
OrbitSizes SizesOf(const MechanicalSystem& system, const Trajectory& run);

/// A start that is further off is on no orbit.
inline constexpr double kOnOrbit = 1e-6;

/// How far P(x) is from x beside the sizes of motion and place, but for what is along those columns
/// of `neutral` [2d×k] that change no velocity: a robot that walks on is on its orbit.
double OffOrbit(const MechanicalSystem& system, const VectorRef& x, const PoincareReturn& one,
                const MatrixRef& neutral);

/// Why P(x), further along `neutral` than x, is not on the orbit of x: the next return of `map` is
/// another, as where the ground is. Empty where nothing tells, and where P(x) is no further.
std::string NextReturnDiffers(const MechanicalSystem& system, const PoincareMap& map,
                              const VectorRef& x, const PoincareReturn& one,
                              const MatrixRef& neutral);

}  // namespace contact_flow
