// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// A joint that stops at `lower`: a = q − lower.
struct LowerLimit {
  static constexpr const char* kName = "lower_limit";
  static constexpr int kPoints = 0, kJoints = 1, kNumbers = 1;
  static constexpr bool kAffine = true, kTouches = false;

  static void Read(ElementFields* fields) {
    fields->Joint("joint");
    fields->Number("lower", ElementFields::kRequired, "m or rad", "smallest position", Range::kAny);
  }

  template <class S>
  static S Gap(const S* number, const S* z) {
    return z[0] - number[0];
  }
};

/// A joint that stops at `upper`: a = upper − q.
struct UpperLimit {
  static constexpr const char* kName = "upper_limit";
  static constexpr int kPoints = 0, kJoints = 1, kNumbers = 1;
  static constexpr bool kAffine = true, kTouches = false;

  static void Read(ElementFields* fields) {
    fields->Joint("joint");
    fields->Number("upper", ElementFields::kRequired, "m or rad", "largest position", Range::kAny);
  }

  template <class S>
  static S Gap(const S* number, const S* z) {
    return number[0] - z[0];
  }
};

}  // namespace constraint
}  // namespace contact_flow
