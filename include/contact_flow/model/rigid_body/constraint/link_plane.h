// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// A point of a link, or a sphere about it, above a plane fixed in another link:
///   a = n·(p − o) − radius,
/// the unit normal n in world axes as the difference of the plane's point o and one a unit along n.
struct LinkPlane {
  static constexpr const char* kName = "link_plane";
  static constexpr int kPoints = 3, kJoints = 0, kNumbers = 1;
  static constexpr bool kAffine = false;

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
};

}  // namespace constraint
}  // namespace contact_flow
