// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// Two spheres about points of links: a = |p − p_other| − radius − other_radius.
struct Spheres {
  static constexpr const char* kName = "spheres";
  static constexpr int kPoints = 2, kJoints = 0, kNumbers = 2;
  static constexpr bool kAffine = false;

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
};

}  // namespace constraint
}  // namespace contact_flow
