// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/zeno_detector.h"

#include <cmath>

namespace contact_flow {

std::optional<double> ZenoDetector::Impact(int i, double t) {
  std::vector<double>& times = impacts_[i];
  times.push_back(t);
  if (times.size() > 4) times.erase(times.begin());
  if (times.size() < 4) return std::nullopt;
  const double first = times[1] - times[0], second = times[2] - times[1], last = t - times[2];
  const double ratio = last / second, ratio_before = second / first;
  const bool shrinking = ratio < 1 && std::abs(ratio - ratio_before) < 0.05 * ratio;
  if (!shrinking || last > interval_) return std::nullopt;
  return t + last * ratio / (1 - ratio);
}

}  // namespace contact_flow
