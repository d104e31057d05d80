// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

#include "contact_flow/constraint_set.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// When contacts were last closed. Where one leaves its gap is zero, whatever errors positions
/// have: for as long as steps add nothing it is known better than these tell. Allocates once.
class ClosedGaps {
 public:
  explicit ClosedGaps(int n) : time_(Vector::Constant(n, kNever)), gap_(Vector::Zero(n)) {}

  /// These are closed at time t [s], with gaps [n] that integration has left.
  void Note(double t, ConstraintSet closed, const VectorRef& gap) {
    for (int i : closed) {
      time_(i) = t;
      gap_(i) = std::abs(gap(i));
    }
  }
  /// The time since contact i was closed at time t [s]; +∞ where it never was.
  double Since(int i, double t) const { return t - time_(i); }
  /// What a gap whose rate is known to so much [m/s] is known to at time t [m]; +∞ where it never
  /// was closed.
  double Error(int i, double t, double of_rate) const {
    return time_(i) == kNever ? std::numeric_limits<double>::infinity()
                              : gap_(i) + (t - time_(i)) * of_rate;
  }

 private:
  static constexpr double kNever = -std::numeric_limits<double>::infinity();

  Vector time_;  // [s]
  Vector gap_;   // then [m]
};

}  // namespace contact_flow
