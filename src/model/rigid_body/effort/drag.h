// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace effort {

/// Drag of the air on a point of a link: with its velocity v against the wind's,
///   e = −(linear + quadratic √(v·v + kStill²)) v.
/// At speeds far above kStill that is −(linear + quadratic |v|) v; below it is smooth.
struct Drag {
  static constexpr const char* kName = "drag";
  static constexpr int kPoints = 1, kJoints = 0, kInputs = 0, kNumbers = 5;
  static constexpr double kStill = 1e-6;  ///< [m/s]

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->Number("linear", 0, "N s/m", "drag per speed", Range::kNonNegative);
    fields->Number("quadratic", 0, "N s^2/m^2", "drag per square of the speed",
                   Range::kNonNegative);
    fields->Vector("wind", Vec3<double>::Zero(), "m/s", "of the air, in world axes");
  }

  template <class S>
  static void Effort(const S* number, const S*, const S* rate, const S*, S* e) {
    using std::sqrt;
    S v[3], square = S(kStill * kStill);
    for (int k = 0; k < 3; ++k) {
      v[k] = rate[k] - number[2 + k];
      square += v[k] * v[k];
    }
    const S factor = number[0] + number[1] * sqrt(square);
    for (int k = 0; k < 3; ++k) e[k] = -(factor * v[k]);
  }
};

}  // namespace effort
}  // namespace contact_flow
