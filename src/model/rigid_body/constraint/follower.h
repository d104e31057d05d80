// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// A joint that follows another: b = q − multiplier q_master − offset. For bilateral constraints.
struct Follower {
  static constexpr int kPoints = 0, kJoints = 2, kNumbers = 2;
  static constexpr bool kAffine = true, kTouches = false;

  template <class S>
  static S Gap(const S* number, const S* z) {
    return z[0] - number[0] * z[1] - number[1];
  }
};

}  // namespace constraint
}  // namespace contact_flow
