// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

namespace contact_flow {

/// Watches the impacts of each constraint for intervals that shrink geometrically (Zeno), as those
/// of a bouncing ball or, plastic but in turns, of a block that rocks to rest: with ratio r < 1 and
/// last interval Δ, impacts accumulate at t + Δ r/(1−r).
class ZenoDetector {
 public:
  /// Intervals longer than `interval` [s] are not yet worth stopping for.
  ZenoDetector(int num_constraints, double interval)
      : interval_(interval), impacts_(num_constraints) {}

  /// Records an impact on constraint i; returns the accumulation time [s] once the last three
  /// intervals shrink by ratios that agree within 5 % and the last is shorter than `interval`.
  std::optional<double> Impact(int i, double t);

 private:
  double interval_;
  std::vector<std::vector<double>> impacts_;
};

}  // namespace contact_flow
