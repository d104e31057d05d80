// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace effort {

/// Spring and damper at a joint: e = −stiffness (q − rest) − damping q̇.
struct JointSpring {
  static constexpr const char* kName = "joint_spring";
  static constexpr int kPoints = 0, kJoints = 1, kInputs = 0, kNumbers = 3;

  static void Read(ElementFields* fields) {
    fields->Joint("joint");
    fields->Number("stiffness", 0, "N/m or N m/rad", "effort per displacement",
                   Range::kNonNegative);
    fields->Number("damping", 0, "N s/m or N m s/rad", "effort per rate", Range::kNonNegative);
    fields->Number("rest", 0, "m or rad", "where the spring is slack", Range::kAny);
  }

  template <class S>
  static void Effort(const S* number, const S* z, const S* rate, const S*, S* e) {
    e[0] = -(number[0] * (z[0] - number[2])) - number[1] * rate[0];
  }
};

}  // namespace effort
}  // namespace contact_flow
