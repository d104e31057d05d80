// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace effort {

/// A flywheel that couples two feet, as in the paper's trots: it drives a joint by e = gain · (d/dt
/// (up · (p − p_other)))², up the world's z.
struct Flywheel {
  static constexpr const char* kName = "flywheel";
  static constexpr int kPoints = 2, kJoints = 1, kInputs = 0, kNumbers = 1;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->Point("other_link", "other_point");
    fields->Joint("joint");
    fields->Number("gain", ElementFields::kRequired, "N m s^2/m^2",
                   "effort per squared difference of vertical rates", Range::kAny);
  }

  template <class S>
  static void Effort(const S* number, const S*, const S* rate, const S*, S* e) {
    const S difference = rate[2] - rate[5];
    for (int k = 0; k < 6; ++k) e[k] = S(0.0);
    e[6] = number[0] * (difference * difference);
  }
};

}  // namespace effort
}  // namespace contact_flow
