// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/constraint/touch.h"
#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// A point of a link above a terrain whose heights are given on a grid (HeightGrid),
///   a = z − height − scale h(x, y).
struct HeightMap {
  static constexpr const char* kName = "height_map";
  static constexpr int kPoints = 1, kJoints = 0, kNumbers = 2;
  static constexpr bool kAffine = false, kTable = true;
  static constexpr bool kTouches = true, kSlipAffine = false;
  static constexpr int kOther = -1, kTips = 0, kTurns = 0;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->Heights();
    fields->Number("height", 0, "m", "added to the heights", Range::kAny);
    fields->Number("scale", 1, "", "that heights are multiplied by", Range::kAny);
  }

  template <class S>
  static S Gap(const HeightGrid& heights, const S* number, const S* z) {
    S height, slope_x, slope_y;
    heights.At(z[0], z[1], &height, &slope_x, &slope_y);
    return z[2] - number[0] - number[1] * height;
  }

  template <class S>
  static Touch<S> At(const HeightGrid& heights, const S* number, const S* z) {
    S height, x, y;
    heights.At(z[0], z[1], &height, &x, &y);
    return OnSlope<S>(number[1] * x, number[1] * y);
  }
  template <class S>
  static void Tangents(const S*, const Touch<S>& touch, Vec3<S>* first, Vec3<S>* second) {
    LevelTangents(touch.normal, first, second);
  }
};

}  // namespace constraint
}  // namespace contact_flow
