// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// Coulomb friction of a joint, as of a brake: a pad that nothing but a force of 1 rests on its
/// stop, a = pad ≥ 0, and slips as the joint moves, s = q̇. With that force its coefficient of
/// friction is the largest torque [N·m] or force [N] of the friction.
struct Brake {
  static constexpr int kPoints = 0, kJoints = 2, kNumbers = 0;
  static constexpr bool kAffine = true, kTouches = false;

  /// z = (q, pad).
  template <class S>
  static S Gap(const S*, const S* z) {
    return z[1];
  }
};

}  // namespace constraint
}  // namespace contact_flow
