// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/model/rigid_body/constraint/touch.h"
#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// A point of a link, or a sphere about it, above a plane fixed in the world:
///   a = n·p/|n| − offset − radius.
/// It touches at p − radius n.
struct Plane {
  static constexpr const char* kName = "plane";
  static constexpr int kPoints = 1, kJoints = 0, kNumbers = 5;
  static constexpr bool kAffine = true;
  static constexpr bool kTouches = true, kSlipAffine = true;
  static constexpr int kOther = -1, kTips = 0, kTurns = 1;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->Vector("normal", Vec3<double>::UnitZ(), "", "of the plane, towards the free side");
    fields->Number("offset", 0, "m", "of the plane from the world's origin along its normal",
                   Range::kAny);
    fields->Number("radius", 0, "m", "of a sphere about the point", Range::kNonNegative);
  }

  template <class S>
  static S Gap(const S* number, const S* z) {
    using std::sqrt;
    const S length = sqrt(S(number[0] * number[0] + number[1] * number[1] + number[2] * number[2]));
    const S height = number[0] * z[0] + number[1] * z[1] + number[2] * z[2];
    return height / length - number[3] - number[4];
  }

  template <class S>
  static Touch<S> At(const S* number, const S*) {
    const Vec3<S> n = UnitAlong(number);
    return {n, Vec3<S>(-number[4] * n(0), -number[4] * n(1), -number[4] * n(2)), S(1.0)};
  }
  template <class S>
  static void Tangents(const S*, const Touch<S>& touch, Vec3<S>* first, Vec3<S>* second) {
    LevelTangents(touch.normal, first, second);
  }
};

}  // namespace constraint
}  // namespace contact_flow
