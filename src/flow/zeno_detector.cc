// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/zeno_detector.h"

#include <cmath>

namespace contact_flow {
namespace {

constexpr double kAgree = 0.05;  // how far ratios of one sequence may be apart, relative

}  // namespace

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
  const bool geometric = ratio < 1 && std::abs(ratio - ratio_before) < kAgree * ratio;
  if (!geometric || last > shrinkage_ * sequence->first) return std::nullopt;
  return t + last * ratio / (1 - ratio);
}

std::optional<double> ZenoDetector::Impact(ConstraintSet hit, double t) {
  std::optional<double> accumulation = Record(t, &sequences_.back());
  for (int i : hit) {
    const std::optional<double> own = Record(t, &sequences_[i]);
    if (own) accumulation = own;
  }
  if (hits_.size() > 3 * kLongestPattern) hits_.erase(hits_.begin());
  hits_.push_back({t, hit});
  pattern_ = {};
  const std::optional<double> of_pattern = FindPattern();
  if (!accumulation) return of_pattern;
  pattern_ = {};
  return accumulation;
}

/// The shortest pattern whose last three intervals, from each of its impacts to the same one of the
/// next time, shrink by ratios that agree.
std::optional<double> ZenoDetector::FindPattern() {
  const std::size_t n = hits_.size();
  std::optional<double> found;
  for (std::size_t length = 2; length <= kLongestPattern && length < n; ++length) {
    const auto interval = [&](std::size_t back) {
      const std::size_t end = n - 1 - back * length;
      return hits_[end].t - hits_[end - length].t;
    };
    const double last = interval(0);
    const bool shrinks = 2 * length < n && last < interval(1);
    if (!shrinks) first_of_length_[length] = last;
    if (found || !(3 * length < n)) continue;
    const double before = interval(1);
    const double ratio = last / before, ratio_before = before / interval(2);
    const bool geometric = ratio < 1 && std::abs(ratio - ratio_before) < kAgree * ratio;
    if (!geometric || last > shrinkage_ * first_of_length_[length]) continue;
    found = hits_.back().t + last * ratio / (1 - ratio);
    for (std::size_t k = n - 2 * length; k < n; ++k) pattern_ = pattern_ | hits_[k].constraints;
  }
  return found;
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
