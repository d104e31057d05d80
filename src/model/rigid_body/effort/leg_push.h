// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace effort {

/// What feeds energy into a hopping leg of length q: a push along its motion that saturates, and
/// fades where the leg has its rest length,
///   e = push · tanh(q̇/rate) · s²/(s² + strain²),       s = (q − length)/length.
struct LegPush {
  static constexpr const char* kName = "leg_push";
  static constexpr int kPoints = 0, kJoints = 1, kInputs = 0, kNumbers = 4;

  static void Read(ElementFields* fields) {
    fields->Joint("joint");
    fields->Number("push", ElementFields::kRequired, "N", "largest effort", Range::kAny);
    fields->Number("rate", ElementFields::kRequired, "m/s", "leg rate at which it saturates",
                   Range::kPositive);
    fields->Number("strain", ElementFields::kRequired, "", "leg strain at which it is half on",
                   Range::kPositive);
    fields->Number("length", ElementFields::kRequired, "m", "length of the leg at rest",
                   Range::kPositive);
  }

  template <class S>
  static void Effort(const S* number, const S* z, const S* rate, const S*, S* e) {
    using std::tanh;
    const S strain = (z[0] - number[3]) / number[3];
    const S square = strain * strain;
    const S engaged = square / (square + number[2] * number[2]);
    e[0] = number[0] * (tanh(S(rate[0] / number[1])) * engaged);
  }
};

}  // namespace effort
}  // namespace contact_flow
