// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/model/rigid_body/spatial.h"

namespace contact_flow {
namespace constraint {

/// Where two bodies touch, in world axes, smooth in z also beside a = 0.
template <class S>
struct Touch {
  Vec3<S> normal;  ///< unit, away from the surface
  Vec3<S> arm;     ///< from the element's first point to the contact [m]
  /// |∇a|, by which λ is smaller than the force along the normal: T is as much longer than a map
  /// to velocities, so that |λ_t| ≤ μ λ_n is Coulomb's law.
  S stretch;
};

/// A point above a surface z = h(x, y) that rises by `x` and `y`, ∂h: ∇a = (−∂h, 1).
template <class S>
Touch<S> OnSlope(const S& x, const S& y) {
  using std::sqrt;
  const S length = sqrt(x * x + y * y + 1.0);
  return {Vec3<S>(-x / length, -y / length, 1.0 / length), Zero3<S>(), length};
}

/// The direction `axis`, which is across the unit vector `pole`, after the shortest turn that takes
/// `pole` into the unit vector `normal` ≠ −pole: axis − (axis·n) (pole + n)/(1 + pole·n).
template <class S>
Vec3<S> TurnedAlong(const Vec3<double>& axis, const Vec3<double>& pole, const Vec3<S>& normal) {
  S along = S(0.0), cosine = S(0.0);
  for (int k = 0; k < 3; ++k) {
    along += normal(k) * axis(k);
    cosine += normal(k) * pole(k);
  }
  const S share = along / (cosine + 1.0);
  Vec3<S> turned;
  for (int k = 0; k < 3; ++k) turned(k) = axis(k) - share * (normal(k) + pole(k));
  return turned;
}

/// The world's x and y after the shortest turn that takes z into the normal, or its negative where
/// that looks down: the tangents of a surface that is fixed in the world.
template <class S>
void LevelTangents(const Vec3<S>& normal, Vec3<S>* first, Vec3<S>* second) {
  const Vec3<S> up = normal(2) < S(0.0) ? Vec3<S>(-normal(0), -normal(1), -normal(2)) : normal;
  *first = TurnedAlong<S>(Vec3<double>::UnitX(), Vec3<double>::UnitZ(), up);
  *second = TurnedAlong<S>(Vec3<double>::UnitY(), Vec3<double>::UnitZ(), up);
}

/// The unit vector along three numbers.
template <class S>
Vec3<S> UnitAlong(const S* number) {
  using std::sqrt;
  const S length = sqrt(number[0] * number[0] + number[1] * number[1] + number[2] * number[2]);
  return Vec3<S>(number[0] / length, number[1] / length, number[2] / length);
}

}  // namespace constraint
}  // namespace contact_flow
