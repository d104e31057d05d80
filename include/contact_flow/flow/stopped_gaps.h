// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/constraint_set.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// Gaps that fell until an impact elsewhere turned or stopped them. Such a gap has a minimum there
/// if it rises behind it, at once or after it has stood, though no motion between two events has.
class StoppedGaps {
 public:
  explicit StoppedGaps(const SimulateOptions& options)
      : still_(options.speed_tolerance),
        weak_(still_ * still_ / (2 * options.absolute_tolerance)) {}

  /// An impact, of these terms, in which the gaps of `open` take no part: they are open before and
  /// behind it. No others are followed any longer.
  void Impact(const ConstraintSet& open, const ConstraintTerms& terms, const VectorRef& v_minus,
              const VectorRef& v_plus);
  /// Where a step or an arc begins. One that rises lowers `margin` to where it was stopped, one
  /// that falls is as any other, one that stands is followed on.
  void Follow(const GapSample& at, double* margin) {
    if (!stopped_.Empty()) Judge(at, margin);
  }

 private:
  void Judge(const GapSample& at, double* margin);

  const double still_;  // the speed of what stands [m/s]
  const double weak_;   // … and its acceleration, by which it stands for longer than is resolved
  ConstraintSet stopped_;
  Vector at_;  // where [constraints, m]
};

}  // namespace contact_flow
