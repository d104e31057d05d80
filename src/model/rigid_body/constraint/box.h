// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "contact_flow/model/narrow_surfaces.h"
#include "contact_flow/model/rigid_body/constraint/touch.h"
#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// A point of a link above a box that stands on the ground, its edges upright or level:
///   a = z − c_z + 3/2 h − 2 h s_x s_y,      s_x = σ(½ + (l/2 − x)/riser) σ(½ + (l/2 + x)/riser)
/// and s_y alike, at (x, y) from its centre c in its own axes, σ as of Stairs. Its top is level;
/// each side leans inwards over the length `riser`, from its edge on the ground, and goes on as far
/// down as the box is high, so that the ground around it has no second surface. It lies inside of
/// the box by up to riser/2, and is as smooth as contact has to be (C²).
struct Box {
  static constexpr const char* kName = "box";
  static constexpr int kPoints = 1, kJoints = 0, kNumbers = 8;
  static constexpr bool kAffine = false;
  static constexpr bool kTouches = true, kSlipAffine = false;
  static constexpr int kOther = -1, kTips = 0, kTurns = 0;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    const Vec3<double> required = Vec3<double>::Constant(ElementFields::kRequired);
    fields->Vector("center", required, "m", "of the box");
    fields->Number("length", ElementFields::kRequired, "m", "along its own x", Range::kPositive);
    fields->Number("width", ElementFields::kRequired, "m", "along its own y", Range::kPositive);
    fields->Number("height", ElementFields::kRequired, "m", "of the box", Range::kPositive);
    fields->Number("yaw", 0, "rad", "of its own axes about z", Range::kAny);
    fields->Number("riser", ElementFields::kRequired, "m", "length in which a side rises",
                   Range::kPositive);
  }

  template <class S>
  static S Gap(const S* number, const S* z) {
    S slope_x, slope_y;
    return z[2] - Height(number, z, &slope_x, &slope_y);
  }

  template <class S>
  static Touch<S> At(const S* number, const S* z) {
    S slope_x, slope_y;
    Height(number, z, &slope_x, &slope_y);
    return OnSlope<S>(slope_x, slope_y);
  }
  template <class S>
  static void Tangents(const S*, const Touch<S>& touch, Vec3<S>* first, Vec3<S>* second) {
    LevelTangents(touch.normal, first, second);
  }

  /// Where its sides begin and end to lean, in its own axes from its centre.
  static std::vector<std::vector<double>> Knots(const ElementParts& parts) {
    const double half_riser = 0.5 * parts.numbers[7].value;
    const auto sides = [&](double length) {
      const double low = 0.5 * length - half_riser, high = 0.5 * length + half_riser;
      std::vector<double> at = {-high, -low, low, high};
      std::sort(at.begin(), at.end());
      return at;
    };
    return {sides(parts.numbers[3].value), sides(parts.numbers[4].value)};
  }
  static void Across(const ElementParts& parts, const double* z, double* own) {
    const double c = std::cos(parts.numbers[6].value), s = std::sin(parts.numbers[6].value);
    const double dx = z[0] - parts.numbers[0].value, dy = z[1] - parts.numbers[1].value;
    own[0] = c * dx + s * dy;
    own[1] = c * dy - s * dx;
  }

  /// It is as narrow as its top. Beside it the surface goes on far below.
  static SurfacePassage Passage(const ElementParts& parts, const double* z, const double* rate) {
    const auto number = [&](std::size_t k) { return parts.numbers[k].value; };
    const double c = std::cos(number(6)), s = std::sin(number(6)), riser = number(7);
    const double speed[] = {c * rate[0] + s * rate[1], c * rate[1] - s * rate[0]};
    double own[2];
    Across(parts, z, own);
    SurfacePassage passage;
    double beside = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < 2; ++k) {
      const double edge = number(3 + k), width = std::max(edge - riser, 0.5 * edge);
      passage.pace = std::max(passage.pace, std::abs(speed[k]) / width);
      beside = std::max(beside, std::abs(own[k]) - 0.5 * (edge + riser));
    }
    const double height = z[2] - number(2);
    passage.above = {height - 0.5 * number(5), std::abs(rate[2])};
    passage.beside = {std::min(beside, height + 1.5 * number(5)),
                      std::hypot(rate[0], rate[1], rate[2])};
    return passage;
  }

  /// Of its surface at z, and the slopes of that along the world's x and y.
  template <class S>
  static S Height(const S* number, const S* z, S* slope_x, S* slope_y) {
    using std::cos;
    using std::sin;
    const S c = cos(number[6]), s = sin(number[6]);
    const S dx = z[0] - number[0], dy = z[1] - number[1];
    S rise_x, rise_y;
    const S along = Share(number[3], number[7], c * dx + s * dy, &rise_x);
    const S across = Share(number[4], number[7], c * dy - s * dx, &rise_y);
    const S whole = 2.0 * number[5];
    rise_x = whole * rise_x * across;
    rise_y = whole * along * rise_y;
    *slope_x = c * rise_x - s * rise_y;
    *slope_y = s * rise_x + c * rise_y;
    return number[2] - 1.5 * number[5] + whole * along * across;
  }

 private:
  /// σ(t), and σ′.
  template <class S>
  static S Step(const S& t, S* slope) {
    *slope = S(0.0);
    if (!(t > S(0.0))) return S(0.0);
    if (!(t < S(1.0))) return S(1.0);
    const S rest = 1.0 - t;
    *slope = 30.0 * (t * t) * (rest * rest);
    return t * t * t * (10.0 - t * (15.0 - 6.0 * t));
  }
  /// s of an edge of this length, and its slope along x.
  template <class S>
  static S Share(const S& length, const S& riser, const S& x, S* slope) {
    S before, behind;
    const S up = Step<S>(0.5 + (0.5 * length + x) / riser, &before);
    const S down = Step<S>(0.5 + (0.5 * length - x) / riser, &behind);
    *slope = (before * down - up * behind) / riser;
    return up * down;
  }
};

}  // namespace constraint
}  // namespace contact_flow
