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

  /// It is as narrow as what a single height raises, two cells.
  static SurfacePassage Passage(const ElementParts& parts, const double*, const double* rate) {
    const HeightGrid::Frame& frame = parts.heights->frame();
    SurfacePassage passage;
    if (parts.numbers[1].value == 0) return passage;
    passage.pace = 0.5 * std::max(std::abs(rate[0]) / frame.dx, std::abs(rate[1]) / frame.dy);
    return passage;
  }

  /// The lines of the grid, across which the point is told in cells.
  static std::vector<std::vector<double>> Knots(const ElementParts& parts) {
    const auto lines = [](int count) {
      std::vector<double> at(static_cast<std::size_t>(count));
      for (std::size_t k = 0; k < at.size(); ++k) at[k] = static_cast<double>(k);
      return at;
    };
    return {lines(parts.heights->nx()), lines(parts.heights->ny())};
  }
  static void Across(const ElementParts& parts, const double* z, double* cells) {
    const HeightGrid::Frame& frame = parts.heights->frame();
    cells[0] = (z[0] - frame.x) / frame.dx;
    cells[1] = (z[1] - frame.y) / frame.dy;
  }
};

}  // namespace constraint
}  // namespace contact_flow
