// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace effort {

/// A proportional-derivative controller with references and feed-forward, all inputs:
///   e = stiffness (u_position − q) + damping (u_velocity − q̇) + u_feed_forward,
/// within its limits.
struct Pd {
  static constexpr const char* kName = "pd";
  static constexpr int kPoints = 0, kJoints = 1, kInputs = 3, kNumbers = 5;
  static constexpr int kLimits = 2;

  static void Read(ElementFields* fields) {
    fields->Joint("joint");
    fields->Input("position");
    fields->Input("velocity");
    fields->Input("feed_forward");
    fields->Gains();
  }

  template <class S>
  static void Effort(const S* number, const S* z, const S* rate, const S* u, S* e) {
    e[0] = number[0] * (u[0] - z[0]) + number[1] * (u[1] - rate[0]) + u[2];
  }
};

}  // namespace effort
}  // namespace contact_flow
