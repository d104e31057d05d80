// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace constraint {

/// One world axis of two points that coincide: b = direction·(p − p_other). For
/// bilateral constraints.
struct Coincidence {
  static constexpr int kPoints = 2, kJoints = 0, kNumbers = 3;
  static constexpr bool kAffine = true, kTouches = false;

  template <class S>
  static S Gap(const S* number, const S* z) {
    S gap = S(0.0);
    for (int k = 0; k < 3; ++k) gap += number[k] * (z[k] - z[3 + k]);
    return gap;
  }
};

/// The same along an axis of the other link, from its point o to a tip t a unit away:
/// b = (t − o)·(p − o).
struct LinkCoincidence {
  static constexpr int kPoints = 3, kJoints = 0, kNumbers = 0;
  static constexpr bool kAffine = false, kTouches = false;

  template <class S>
  static S Gap(const S*, const S* z) {
    S gap = S(0.0);
    for (int k = 0; k < 3; ++k) gap += (z[6 + k] - z[3 + k]) * (z[k] - z[3 + k]);
    return gap;
  }
};

}  // namespace constraint
}  // namespace contact_flow
