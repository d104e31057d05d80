// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace effort {

/// A push or gust: a force on a point of a link, in world axes, that follows a function of time
/// r(t), t the robot's clock:
///   e = r force.
struct TimedForce {
  static constexpr const char* kName = "timed_force";
  static constexpr int kPoints = 1, kJoints = 1, kInputs = 0, kNumbers = 3;
  static constexpr bool kFollows = true;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->Reference("reference");
    fields->Vector("force", Vec3<double>::Constant(ElementFields::kRequired), "N",
                   "component in world axes, where the reference is 1");
  }

  template <class S>
  static void Effort(const S* number, const S*, const S*, const S* u, S* e) {
    for (int k = 0; k < 3; ++k) e[k] = u[0] * number[k];
  }
};

}  // namespace effort
}  // namespace contact_flow
