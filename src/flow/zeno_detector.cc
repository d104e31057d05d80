// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/zeno_detector.h"

#include <cmath>

namespace contact_flow {

std::optional<double> ZenoDetector::Record(double t, Sequence* sequence) const {
  std::vector<double>& times = sequence->times;
  times.push_back(t);
  if (times.size() > 4) times.erase(times.begin());
  if (times.size() < 2) return std::nullopt;
  const auto interval = [&](std::size_t k) { return times[k + 1] - times[k]; };
  const std::size_t newest = times.size() - 2;
  const double last = interval(newest);
  const bool shrinks = newest > 0 && last < interval(newest - 1);
  if (!shrinks) sequence->first = last;
  if (times.size() < 4) return std::nullopt;
  const double ratio = last / interval(1), ratio_before = interval(1) / interval(0);
  const bool geometric = ratio < 1 && std::abs(ratio - ratio_before) < 0.05 * ratio;
  if (!geometric || last > shrinkage_ * sequence->first) return std::nullopt;
  return t + last * ratio / (1 - ratio);
}

std::optional<double> ZenoDetector::Impact(ConstraintSet hit, double t) {
  std::optional<double> accumulation = Record(t, &sequences_.back());
  for (int i : hit) {
    const std::optional<double> own = Record(t, &sequences_[i]);
    if (own) accumulation = own;
  }
  return accumulation;
}

std::optional<double> ZenoDetector::ImpactTo(double next) const {
  const std::vector<double>& times = sequences_.back().times;
  if (times.size() < 3) return std::nullopt;
  const std::size_t n = times.size();
  const double last = times[n - 1] - times[n - 2], before = times[n - 2] - times[n - 3];
  const double ratio = (next - times[n - 1]) / last, ratio_before = last / before;
  const bool geometric = ratio < 1 && std::abs(ratio - ratio_before) < 0.3 * ratio_before;
  if (!geometric) return std::nullopt;
  return times[n - 1] + last * ratio / (1 - ratio);
}

}  // namespace contact_flow
