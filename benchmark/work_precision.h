// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace contact_flow {
namespace benchmark {

/// One run of a sweep over tolerances.
struct WorkPoint {
  double tolerance = 0;
  double error = 0;
  double right_hand_sides = 0;
  double seconds = 0;
};

/// What a method needs for a given error.
struct WorkAtError {
  bool reached = false;  ///< the sweep has points on either side of the error
  double tolerance = 0;
  double right_hand_sides = 0;
  double seconds = 0;
};

/// Work at an error: the straight line, in logarithms, of tolerance, right-hand sides and time over
/// error that fits the points within a factor of 30 best. A single run may be accurate by luck; a
/// line is not.
WorkAtError FitWork(const std::vector<WorkPoint>& points, double error);

}  // namespace benchmark
}  // namespace contact_flow
