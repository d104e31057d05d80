// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/model/narrow_surfaces.h"
#include "contact_flow/model/rigid_body/constraint/touch.h"
#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// A point of a link above smooth rolling terrain: a = z − h(x, y), a vertical distance, with
///   h = height + slope·(x, y) + amplitude sin(wave·(x, y) + phase).
/// With g = (−∂h/∂x, −∂h/∂y, 1) the force along the unit normal is |g| λ, and T is |g| times the
/// velocity along the tangents.
struct HeightField {
  static constexpr const char* kName = "height_field";
  static constexpr int kPoints = 1, kJoints = 0, kNumbers = 7;
  static constexpr bool kAffine = false;
  static constexpr bool kTouches = true, kSlipAffine = false;
  static constexpr int kOther = -1, kTips = 0, kTurns = 0;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->Number("height", 0, "m", "of the terrain's mean at x = y = 0", Range::kAny);
    fields->Number("slope_x", 0, "", "rise along x", Range::kAny);
    fields->Number("slope_y", 0, "", "rise along y", Range::kAny);
    fields->Number("amplitude", 0, "m", "of the waves", Range::kNonNegative);
    fields->Number("wave_x", 0, "rad/m", "wave number along x", Range::kAny);
    fields->Number("wave_y", 0, "rad/m", "wave number along y", Range::kAny);
    fields->Number("phase", 0, "rad", "of the waves at x = y = 0", Range::kAny);
  }

  template <class S>
  static S Gap(const S* number, const S* z) {
    using std::sin;
    const S wave = number[4] * z[0] + number[5] * z[1] + number[6];
    return z[2] - number[0] - number[1] * z[0] - number[2] * z[1] - number[3] * sin(wave);
  }

  template <class S>
  static Touch<S> At(const S* number, const S* z) {
    using std::cos;
    const S rise = number[3] * cos(number[4] * z[0] + number[5] * z[1] + number[6]);
    return OnSlope<S>(number[1] + number[4] * rise, number[2] + number[5] * rise);
  }
  template <class S>
  static void Tangents(const S*, const Touch<S>& touch, Vec3<S>* first, Vec3<S>* second) {
    LevelTangents(touch.normal, first, second);
  }

  /// It is as narrow as half a wave.
  static SurfacePassage Passage(const ElementParts& parts, const double* z, const double* rate) {
    const auto number = [&](std::size_t k) { return parts.numbers[k].value; };
    SurfacePassage passage;
    if (number(3) == 0) return passage;
    constexpr double kHalfWave = 3.14159265358979323846;
    passage.pace = std::abs(number(4) * rate[0] + number(5) * rate[1]) / kHalfWave;
    const double mean = number(0) + number(1) * z[0] + number(2) * z[1];
    const double rise = number(1) * rate[0] + number(2) * rate[1];
    passage.above = {z[2] - mean - number(3), std::abs(rate[2] - rise)};
    return passage;
  }
};

}  // namespace constraint
}  // namespace contact_flow
