// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace effort {

/// An input that drives a joint through a gear: e = gear u, within its limits.
struct Actuator {
  static constexpr const char* kName = "actuator";
  static constexpr int kPoints = 0, kJoints = 1, kInputs = 1, kNumbers = 4;
  static constexpr int kLimits = 1;

  static void Read(ElementFields* fields) {
    fields->Joint("joint");
    fields->Input("input");
    fields->Number("gear", 1, "", "joint effort per input", Range::kAny);
    fields->Limits();
  }

  template <class S>
  static void Effort(const S* number, const S*, const S*, const S* u, S* e) {
    e[0] = number[0] * u[0];
  }
};

}  // namespace effort
}  // namespace contact_flow
