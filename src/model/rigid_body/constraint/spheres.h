// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/model/narrow_surfaces.h"
#include "contact_flow/model/rigid_body/constraint/touch.h"
#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// Two spheres about points of links: a = |p − p_other| − radius − other_radius.
/// The tangents are two directions across `pole` after the shortest turn that takes the pole into
/// the normal: smooth but where the normal is its opposite, a direction that nothing prefers.
struct Spheres {
  static constexpr const char* kName = "spheres";
  static constexpr int kPoints = 2, kJoints = 0, kNumbers = 2;
  static constexpr bool kAffine = false;
  static constexpr bool kTouches = true, kSlipAffine = false;
  static constexpr int kOther = 1, kTips = 0, kTurns = 2;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->Point("other_link", "other_point");
    fields->Number("radius", ElementFields::kRequired, "m", "of the first sphere",
                   Range::kPositive);
    fields->Number("other_radius", ElementFields::kRequired, "m", "of the other sphere",
                   Range::kNonNegative);
  }

  template <class S>
  static S Gap(const S* number, const S* z) {
    using std::sqrt;
    S square = S(0.0);
    for (int k = 0; k < 3; ++k) {
      const S d = z[k] - z[3 + k];
      square += d * d;
    }
    return sqrt(square) - number[0] - number[1];
  }

  template <class S>
  static Touch<S> At(const S* number, const S* z) {
    const S apart[] = {z[0] - z[3], z[1] - z[4], z[2] - z[5]};
    const Vec3<S> n = UnitAlong(apart);
    return {n, Vec3<S>(-number[0] * n(0), -number[0] * n(1), -number[0] * n(2)), S(1.0)};
  }
  template <class S>
  static void Tangents(const S*, const Touch<S>& touch, Vec3<S>* first, Vec3<S>* second) {
    const Vec3<double> pole(2. / 7, 3. / 7, 6. / 7);
    *first = TurnedAlong<S>({6. / 7, 2. / 7, -3. / 7}, pole, touch.normal);
    *second = TurnedAlong<S>({-3. / 7, 6. / 7, -2. / 7}, pole, touch.normal);
  }

  /// They are as narrow as half of what is hit through the middle.
  static SurfacePassage Passage(const ElementParts& parts, const double* z, const double* rate) {
    const double reach = parts.numbers[0].value + parts.numbers[1].value;
    const double speed = std::hypot(rate[0] - rate[3], rate[1] - rate[4], rate[2] - rate[5]);
    const double apart = std::hypot(z[0] - z[3], z[1] - z[4], z[2] - z[5]);
    SurfacePassage passage;
    passage.pace = speed / reach;
    passage.beside = {apart - reach, speed};
    return passage;
  }
};

}  // namespace constraint
}  // namespace contact_flow
