// SPDX-License-Identifier: BSD-3-Clause
#include "work_precision.h"

#include <cmath>

namespace contact_flow {
namespace benchmark {
namespace {

constexpr double kWindow = 30;

/// Value at 0 of the least-squares line through (x, y).
double ValueAtZero(const std::vector<double>& x, const std::vector<double>& y) {
  const double n = static_cast<double>(x.size());
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    sx += x[k];
    sy += y[k];
    sxx += x[k] * x[k];
    sxy += x[k] * y[k];
  }
  const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
  return (sy - slope * sx) / n;
}

}  // namespace

WorkAtError FitWork(const std::vector<WorkPoint>& points, double error) {
  std::vector<double> distance, tolerance, right_hand_sides, seconds;
  bool above = false, below = false;
  for (const WorkPoint& point : points) {
    const double x = std::log(point.error / error);
    if (!(std::abs(x) <= std::log(kWindow))) continue;
    (x > 0 ? above : below) = true;
    distance.push_back(x);
    tolerance.push_back(std::log(point.tolerance));
    right_hand_sides.push_back(std::log(point.right_hand_sides));
    seconds.push_back(std::log(point.seconds));
  }
  if (!above || !below) return {};
  return {true, std::exp(ValueAtZero(distance, tolerance)),
          std::exp(ValueAtZero(distance, right_hand_sides)),
          std::exp(ValueAtZero(distance, seconds))};
}

}  // namespace benchmark
}  // namespace contact_flow
