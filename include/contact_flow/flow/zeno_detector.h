// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "contact_flow/constraint_set.h"

namespace contact_flow {

/// Watches impacts for intervals that shrink geometrically (Zeno): of each constraint, as of a
/// bouncing ball, and those of all constraints in turns, as of a block that rocks to rest. With
/// ratio r < 1 and last interval Δ, impacts accumulate at t + Δ r/(1−r). It has no time scale of
/// its own: intervals are compared with the first one of their sequence, from which on each is
/// shorter than the one before. A pattern of several impacts that recurs, each time faster, is one,
/// too: a block that rocks, and bounces each time it falls.
class ZenoDetector {
 public:
  /// Intervals longer than `shrinkage` times the first of their sequence are not yet
  /// worth stopping for.
  ZenoDetector(int num_constraints, double shrinkage)
      : shrinkage_(shrinkage),
        sequences_(num_constraints + 1),
        first_of_length_(kLongestPattern + 1) {}

  /// Records an impact on the constraints in `hit`; returns the accumulation time [s] once the last
  /// three intervals of a sequence shrink by ratios that agree within 5 % and the last
  /// is short enough.
  std::optional<double> Impact(ConstraintSet hit, double t);
  /// The accumulation time [s] if the next impact would come at `next`, and the last two intervals
  /// of all constraints and this one shrink by ratios that agree within 30 %. For sequences that
  /// shrink so fast that no fourth impact is resolved.
  std::optional<double> ImpactTo(double next) const;
  /// All that the last two times of a pattern of several impacts hit, where the last impact was
  /// found to accumulate as one of such a pattern; else nothing.
  const ConstraintSet& pattern() const { return pattern_; }

 private:
  static constexpr std::size_t kLongestPattern = 16;  // impacts

  struct Sequence {
    std::vector<double> times;  // the last four
    double first = 0;           // interval [s]
  };

  struct Hit {
    double t;
    ConstraintSet constraints;
  };

  std::optional<double> Record(double t, Sequence* sequence) const;
  std::optional<double> FindPattern();

  double shrinkage_;
  std::vector<Sequence> sequences_;      // of each constraint, and of all
  std::vector<Hit> hits_;                // the last three times of the longest pattern
  std::vector<double> first_of_length_;  // interval [s] of patterns of 0, 1, 2, … impacts
  ConstraintSet pattern_;
};

}  // namespace contact_flow
