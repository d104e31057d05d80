// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "contact_flow/model/narrow_surfaces.h"
#include "contact_flow/model/rigid_body/constraint/touch.h"
#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// A point of a link above stairs, or above one step or ramp. With s how far it is along the
/// level `direction`,
///   a = z − height − rise Σ_k σ((s − first − k run)/riser),
/// k = 0, 1, … while first + k run < last, σ(t) = t³ (10 − 15 t + 6 t²) from 0 at t ≤ 0 to
/// 1 at t ≥ 1. Its risers lean by `riser`, in which it is as smooth as contact has to be (C²):
/// treads are level, edges and corners rounded by a part of `riser`.
struct Stairs {
  static constexpr const char* kName = "stairs";
  static constexpr int kPoints = 1, kJoints = 0, kNumbers = 9;
  static constexpr bool kAffine = false;
  static constexpr bool kTouches = true, kSlipAffine = false;
  static constexpr int kOther = -1, kTips = 0, kTurns = 0;
  static constexpr int kMostSteps = 1000;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->Number("height", 0, "m", "of the ground before them", Range::kAny);
    fields->Number("rise", ElementFields::kRequired, "m", "of a step; negative: downward",
                   Range::kAny);
    fields->Number("run", ElementFields::kRequired, "m", "of a step", Range::kPositive);
    fields->Number("riser", ElementFields::kRequired, "m", "length in which a step rises",
                   Range::kPositive);
    fields->Number("first", 0, "m", "where the first one rises, along the direction", Range::kAny);
    fields->Number("last", ElementFields::kRequired, "m", "where no more rise", Range::kAny);
    fields->Vector("direction", Vec3<double>::UnitX(), "", "upstairs; its level part counts");
  }

  template <class S>
  static S Gap(const S* number, const S* z) {
    S slope;
    return z[2] - Height(number, z, &slope);
  }

  template <class S>
  static Touch<S> At(const S* number, const S* z) {
    using std::sqrt;
    S slope;
    Height(number, z, &slope);
    const S across = sqrt(number[6] * number[6] + number[7] * number[7]);
    return OnSlope<S>(slope * number[6] / across, slope * number[7] / across);
  }
  template <class S>
  static void Tangents(const S*, const Touch<S>& touch, Vec3<S>* first, Vec3<S>* second) {
    LevelTangents(touch.normal, first, second);
  }

  /// Both ends of each riser, along the direction.
  static std::vector<std::vector<double>> Knots(const ElementParts& parts) {
    const auto number = [&](std::size_t k) { return parts.numbers[k].value; };
    std::vector<double> at;
    double begin = number(4);
    for (int k = 0; k < kMostSteps && begin < number(5); ++k) {
      at.push_back(begin);
      at.push_back(begin + number(3));
      begin += number(2);
    }
    std::sort(at.begin(), at.end());  // risers may be longer than a run
    return {at};
  }
  static void Across(const ElementParts& parts, const double* z, double* along) {
    const double x = parts.numbers[6].value, y = parts.numbers[7].value;
    *along = (x * z[0] + y * z[1]) / std::sqrt(x * x + y * y);
  }

  /// They are as narrow as a tread.
  static SurfacePassage Passage(const ElementParts& parts, const double* z, const double* rate) {
    const auto number = [&](std::size_t k) { return parts.numbers[k].value; };
    const double x = number(6), y = number(7);
    const double steps = std::ceil((number(5) - number(4)) / number(2));
    const double rise = number(1) * std::min(std::max(steps, 0.0), double{kMostSteps});
    SurfacePassage passage;
    passage.pace = std::abs(x * rate[0] + y * rate[1]) / (std::hypot(x, y) * number(2));
    passage.above = {z[2] - number(0) - std::max(rise, 0.0), std::abs(rate[2])};
    return passage;
  }

  /// Of the stairs below z, and its slope along the direction.
  template <class S>
  static S Height(const S* number, const S* z, S* slope) {
    using std::sqrt;
    const S across = sqrt(number[6] * number[6] + number[7] * number[7]);
    const S s = (number[6] * z[0] + number[7] * z[1]) / across;
    S height = number[0], begin = number[4];
    *slope = S(0.0);
    for (int k = 0; k < kMostSteps && begin < number[5] && begin < s; ++k) {
      const S t = (s - begin) / number[3];
      if (t < S(1.0)) {
        const S rest = 1.0 - t;
        height += number[1] * (t * t * t * (10.0 - t * (15.0 - 6.0 * t)));
        *slope += number[1] * (30.0 * (t * t) * (rest * rest)) / number[3];
      } else {
        height += number[1];
      }
      begin += number[2];
    }
    return height;
  }
};

}  // namespace constraint
}  // namespace contact_flow
