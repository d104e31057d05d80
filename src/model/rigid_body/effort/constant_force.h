// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace effort {

/// A force on a point of a link that is constant in world axes.
struct ConstantForce {
  static constexpr const char* kName = "constant_force";
  static constexpr int kPoints = 1, kJoints = 0, kInputs = 0, kNumbers = 3;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->Vector("force", Vec3<double>::Constant(ElementFields::kRequired), "N",
                   "component in world axes");
  }

  template <class S>
  static void Effort(const S* number, const S*, const S*, const S*, S* e) {
    for (int k = 0; k < 3; ++k) e[k] = number[k];
  }
};

}  // namespace effort
}  // namespace contact_flow
