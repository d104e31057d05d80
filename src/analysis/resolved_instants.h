// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "contact_flow/budget.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// Functions of the motion at one instant, all of one size.
struct GuardSample {
  Vector value;
  Vector rate;
  Vector zero;  ///< values up to which they count as zero
};

/// Instants of an arc, its ends included, so close that between two of them each function turns at
/// most once, as far as that matters: a cubic by values and rates at both meets the value at a
/// place between, to a share of what it changes by there and of how far it stays from zero. The
/// place is no simple fraction, so that waves do not pass through the same phase at all three.
/// `sample(t)` gives a GuardSample.
template <class Sample>
std::vector<double> ResolvedInstants(const Arc& arc, const Sample& sample) {
  constexpr int kPieces = 8;                   // of a step, at least
  constexpr int kDepth = 12;                   // of splitting one of these
  constexpr double kPlace = 0.38196601125;     // 2 − the golden ratio
  constexpr double kFit = 0.05, kClear = 0.1;  // shares of the change, and of the least value
  std::vector<double> instants = {arc.t_begin};
  const auto fits = [&](const GuardSample& left, const GuardSample& middle,
                        const GuardSample& right, double length) {
    constexpr double s = kPlace, r = 1 - s;
    for (Eigen::Index i = 0; i < left.value.size(); ++i) {
      const double a = left.value(i), b = right.value(i), c = middle.value(i);
      const double cubic = r * r * (1 + 2 * s) * a + s * s * (3 - 2 * s) * b +
                           length * (r * r * s * left.rate(i) - s * s * r * right.rate(i));
      const double change =
          std::max({std::abs(b - a), std::abs(c - a), length * std::abs(left.rate(i)),
                    length * std::abs(right.rate(i))});
      const double least = std::min({std::abs(a), std::abs(b), std::abs(c)});
      if (std::abs(c - cubic) > std::max({kFit * change, kClear * least, left.zero(i)})) {
        return false;
      }
    }
    return true;
  };
  const auto split = [&](const auto& self, double begin, const GuardSample& left, double end,
                         const GuardSample& right, int depth) -> void {
    AskBudget();
    const double t = begin + kPlace * (end - begin);
    const GuardSample middle = sample(t);
    if (depth < kDepth && !fits(left, middle, right, end - begin)) {
      self(self, begin, left, t, middle, depth + 1);
      self(self, t, middle, end, right, depth + 1);
      return;
    }
    instants.push_back(t);
    instants.push_back(end);
  };
  GuardSample left = sample(arc.t_begin);
  for (std::size_t step = 0; step < arc.dense.NumSteps(); ++step) {
    const double begin = std::max(arc.t_begin, arc.dense.StepBegin(step));
    const double end = std::min(arc.t_end, arc.dense.StepBegin(step) + arc.dense.StepLength(step));
    double from = begin;
    for (int piece = 1; piece <= kPieces && begin < end; ++piece) {
      const double to = begin + (end - begin) * piece / kPieces;
      GuardSample right = sample(to);
      split(split, from, left, to, right, 0);
      left = std::move(right);
      from = to;
    }
  }
  return instants;
}

}  // namespace contact_flow
