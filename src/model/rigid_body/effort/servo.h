// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace effort {

/// A proportional-derivative controller whose setpoint is an input:
///   e = stiffness (u − q) − damping q̇,      within its limits.
struct Servo {
  static constexpr const char* kName = "servo";
  static constexpr int kPoints = 0, kJoints = 1, kInputs = 1, kNumbers = 5;
  static constexpr int kLimits = 2;

  static void Read(ElementFields* fields) {
    fields->Joint("joint");
    fields->Input("input");
    fields->Gains();
  }

  template <class S>
  static void Effort(const S* number, const S* z, const S* rate, const S* u, S* e) {
    e[0] = number[0] * (u[0] - z[0]) - number[1] * rate[0];
  }
};

}  // namespace effort
}  // namespace contact_flow
