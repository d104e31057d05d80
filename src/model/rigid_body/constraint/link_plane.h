// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/constraint/touch.h"
#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// A point of a link, or a sphere about it, above a plane fixed in another link:
///   a = n·(p − o) − radius,
/// the unit normal n in world axes as the difference of the plane's point o and one a unit along n.
/// It touches at p − radius n; the first tangent is fixed in the other link, as a fourth point.
struct LinkPlane {
  static constexpr const char* kName = "link_plane";
  static constexpr int kPoints = 3, kJoints = 0, kNumbers = 1;
  static constexpr bool kAffine = false;
  static constexpr bool kTouches = true, kSlipAffine = false;
  static constexpr int kOther = 1, kTips = 1, kTurns = 2;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->Point("other_link", "other_point");
    fields->TipOf("normal", Vec3<double>::UnitZ());
    fields->Number("radius", 0, "m", "of a sphere about the point", Range::kNonNegative);
  }

  template <class S>
  static S Gap(const S* number, const S* z) {
    S height = -number[0];
    for (int k = 0; k < 3; ++k) height += (z[6 + k] - z[3 + k]) * (z[k] - z[3 + k]);
    return height;
  }

  template <class S>
  static Touch<S> At(const S* number, const S* z) {
    const Vec3<S> n(z[6] - z[3], z[7] - z[4], z[8] - z[5]);
    return {n, Vec3<S>(-number[0] * n(0), -number[0] * n(1), -number[0] * n(2)), S(1.0)};
  }
  template <class S>
  static void Tangents(const S* z, const Touch<S>& touch, Vec3<S>* first, Vec3<S>* second) {
    *first = Vec3<S>(z[9] - z[3], z[10] - z[4], z[11] - z[5]);
    *second = Cross(touch.normal, *first);
  }
  /// The fourth point.
  static AttachedPoint Tip(const ElementParts& parts) {
    AttachedPoint tip = parts.points[1];
    const Vec3<double> normal = parts.points[2].local - tip.local;
    Vec3<double> first, second;
    LevelTangents<double>(normal, &first, &second);
    tip.local += first;
    return tip;
  }
};

}  // namespace constraint
}  // namespace contact_flow
