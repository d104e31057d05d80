// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/model/rigid_body/constraint/touch.h"
#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// A circle fixed in a link, as the rim of a wheel, above a plane fixed in the world:
///   a = n·c − offset − radius √(1 − (n·s)²),
/// with the unit normal n, the centre c and the unit axis s, which must not be along n: there a
/// whole face touches. It touches at c − radius u, u along n − (n·s) s.
struct Rim {
  static constexpr const char* kName = "rim";
  static constexpr int kPoints = 2, kJoints = 0, kNumbers = 5;
  static constexpr bool kAffine = false;
  static constexpr bool kTouches = true, kSlipAffine = false;
  static constexpr int kOther = -1, kTips = 0, kTurns = 1;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->TipOf("axis", Vec3<double>::UnitZ());
    fields->Vector("normal", Vec3<double>::UnitZ(), "", "of the plane, towards the free side");
    fields->Number("offset", 0, "m", "of the plane from the world's origin along its normal",
                   Range::kAny);
    fields->Number("radius", ElementFields::kRequired, "m", "of the circle", Range::kPositive);
  }

  template <class S>
  static S Gap(const S* number, const S* z) {
    using std::sqrt;
    S square = S(0.0), height = S(0.0), along = S(0.0);
    for (int k = 0; k < 3; ++k) {
      square += number[k] * number[k];
      height += number[k] * z[k];
      along += number[k] * (z[3 + k] - z[k]);
    }
    const S length = sqrt(square);
    const S lean = along / length;
    return height / length - number[3] - number[4] * sqrt(S(1.0) - lean * lean);
  }

  template <class S>
  static Touch<S> At(const S* number, const S* z) {
    const Vec3<S> n = UnitAlong(number);
    const Vec3<S> axis(z[3] - z[0], z[4] - z[1], z[5] - z[2]);
    const S lean = Dot(n, axis);
    const S across[] = {n(0) - lean * axis(0), n(1) - lean * axis(1), n(2) - lean * axis(2)};
    const Vec3<S> u = UnitAlong(across);
    return {n, Vec3<S>(-number[4] * u(0), -number[4] * u(1), -number[4] * u(2)), S(1.0)};
  }
  template <class S>
  static void Tangents(const S*, const Touch<S>& touch, Vec3<S>* first, Vec3<S>* second) {
    LevelTangents(touch.normal, first, second);
  }
};

}  // namespace constraint
}  // namespace contact_flow
