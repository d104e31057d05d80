// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace effort {

/// A proportional-derivative controller that follows a function of time r(t), t the robot's clock,
/// with a feed-forward that is an input:
///   e = stiffness (r − q) + damping (ṙ − q̇) + u,      within its limits.
struct Track {
  static constexpr const char* kName = "track";
  static constexpr int kPoints = 0, kJoints = 2, kInputs = 1, kNumbers = 5;
  static constexpr int kLimits = 2;
  static constexpr bool kFollows = true;

  static void Read(ElementFields* fields) {
    fields->Joint("joint");
    fields->Reference("reference");
    fields->Input("feed_forward");
    fields->Gains();
  }

  template <class S>
  static void Effort(const S* number, const S* z, const S* rate, const S* u, S* e) {
    e[0] = number[0] * (u[1] - z[0]) + number[1] * (u[2] * rate[1] - rate[0]) + u[0];
  }
};

}  // namespace effort
}  // namespace contact_flow
