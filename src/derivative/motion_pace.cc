// SPDX-License-Identifier: BSD-3-Clause
#include "motion_pace.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace contact_flow {
namespace {

/// A step that is longer than the one before by this is held back by it alone, and the one before
/// was cut short by something else, as an instant at which a reference changes: the integrator's
/// steps grow by factors of at most 6.
constexpr double kHeldBack = 5.9;
/// Steps of equal length, to rounding, are equal by max_step if there are that many.
constexpr int kMaxEqual = 4;
constexpr double kEqual = 1e-9;
/// Samples of the Jacobian over a whole run of steps, at least: what the state does not feel, as a
/// stiffness across its path, is seen where it acts along more than this part of it.
constexpr double kSamples = 6;
constexpr int kOthers = 2;  // samples of a step beside its nodes

}  // namespace

MotionPace::MotionPace(const DenseArc& dense) {
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  const std::size_t n = dense.NumSteps();
  if (n == 0) return;
  span_ = dense.StepBegin(n - 1) + dense.StepLength(n - 1) - dense.StepBegin(0);
  if (!(span_ > 0)) span_ = kUnknown;  // an event that is moved along the field from the beginning
  double longest = 0;
  for (std::size_t k = 0; k < n; ++k) longest = std::max(longest, dense.StepLength(k));
  const auto is_longest = [&](std::size_t k) {
    return dense.StepLength(k) >= (1 - kEqual) * longest;
  };
  std::size_t equal = 0;
  for (std::size_t k = 0; k < n; ++k) equal += is_longest(k);
  for (std::size_t k = 0; k < n; ++k) {
    double length = dense.StepLength(k);
    if (k + 1 == n) {
      length = k > 0 ? steps_[k - 1].length : kUnknown;  // cut by the end of the arc
    } else if (k == 0 || length > kHeldBack * dense.StepLength(k - 1)) {
      length = kUnknown;  // a guess
    } else if (dense.StepLength(k + 1) > kHeldBack * length) {
      length = kUnknown;  // cut short
    } else if (equal >= kMaxEqual && is_longest(k)) {
      length = kUnknown;  // max_step
    }
    steps_.push_back({dense.StepBegin(k), dense.StepLength(k), length});
  }
}

std::size_t MotionPace::StepAt(double t) const {
  std::size_t after = 0;
  while (after < steps_.size() && steps_[after].begin <= t) ++after;
  return after == 0 ? 0 : after - 1;
}

double MotionPace::StateStep(double t) const { return steps_[StepAt(t)].whole; }

double MotionPace::Reach(double t, int samples) const {
  double reach = (samples + kOthers) * span_ / kSamples;
  for (std::size_t k = StepAt(t); k < steps_.size(); ++k) {
    const double ahead = steps_[k].begin - t;
    if (ahead >= reach) break;
    reach = std::min(reach, std::max(ahead, samples * steps_[k].length));
  }
  return reach;
}

}  // namespace contact_flow
