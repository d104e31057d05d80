// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace effort {

/// Spring and damper between two points: a pull of stiffness (ℓ − length) + damping ℓ̇ along the
/// line from one to the other, ℓ > 0 their distance.
struct PointSpring {
  static constexpr const char* kName = "point_spring";
  static constexpr int kPoints = 2, kJoints = 0, kInputs = 0, kNumbers = 3;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->Point("other_link", "other_point");
    fields->Number("stiffness", 0, "N/m", "pull per stretch", Range::kNonNegative);
    fields->Number("damping", 0, "N s/m", "pull per rate of the length", Range::kNonNegative);
    fields->Number("length", ElementFields::kRequired, "m", "where the spring is slack",
                   Range::kNonNegative);
  }

  template <class S>
  static void Effort(const S* number, const S* z, const S* rate, const S*, S* e) {
    using std::sqrt;
    S square = S(0.0), closing = S(0.0);
    S d[3];
    for (int k = 0; k < 3; ++k) {
      d[k] = z[3 + k] - z[k];
      square += d[k] * d[k];
      closing += d[k] * (rate[3 + k] - rate[k]);
    }
    const S length = sqrt(square);
    const S pull = number[0] * (length - number[2]) + number[1] * (closing / length);
    const S per_length = pull / length;
    for (int k = 0; k < 3; ++k) {
      e[k] = per_length * d[k];
      e[3 + k] = -e[k];
    }
  }
};

}  // namespace effort
}  // namespace contact_flow
