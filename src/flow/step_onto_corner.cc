// SPDX-License-Identifier: BSD-3-Clause
// How a Flow ends a step where one of the CornerFunctions passes a corner.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "contact_flow/flow/flow.h"

namespace contact_flow {
namespace {

constexpr int kMaxCornerNewton = 12, kMaxApproaches = 8;
/// Of a function beside its corner.
constexpr double kCornerRounding = 1e-14;
/// Passings this soon after the node are at it, relative to max(1, t) [s].
constexpr double kAtNode = 1e-13;
/// Part of the way to a passing that is gone first. The last stages of a step onto the corner are
/// beyond it by their errors, which fall with a high power of its length.
constexpr double kApproach = 0.9;
/// Length of the next trial beside the way that is left.
constexpr double kBeyond = 2;

}  // namespace

/// After TryStep(*length) with `error`: where that passes a corner repeats it up to shortly before,
/// or from there up to it; the error of the step that is made then. The stages of the first were on
/// another piece of the field, so that what is made instead is searched again.
double Flow::StepOntoCorner(double error, double* length) {
  constexpr double kFailed = std::numeric_limits<double>::infinity();
  const bool near = t_ == approach_.end;
  FinishStep();
  approach_.rest = 0;
  approach_.onto = false;
  if (!stepper_->end().allFinite()) return kFailed;
  const double whole = error <= 1 ? *length : 0;
  for (int k = 0; k < kMaxApproaches; ++k) {
    const auto zero = corners_.Locate(stepper_, u(), mode_);
    const double s = zero ? zero->theta * *length : 0;
    if (!(s > kAtNode * std::max(1.0, std::abs(t_)))) break;
    approach_.whole = std::max(approach_.whole, whole);
    if (near) {
      approach_.onto = true;
      return NewtonOntoCorner(*zero, s, length);
    }
    *length = kApproach * s;
    approach_.rest = s - *length;
    error = Retry(*length);
    if (!(error <= 1)) break;
  }
  return error;
}

/// TryStep and FinishStep of this length; the error.
double Flow::Retry(double length) {
  constexpr double kFailed = std::numeric_limits<double>::infinity();
  locator_.BeginStep();
  const double error =
      stepper_->TryStep(length, options_.relative_tolerance, options_.absolute_tolerance);
  if (!stepper_->end().allFinite()) return kFailed;
  FinishStep();
  return stepper_->end().allFinite() ? error : kFailed;
}

/// Newton's method for the passing on the true step, from the length s on.
double Flow::NewtonOntoCorner(const CornerLocator::Zero& zero, double s, double* length) {
  const double longest = *length;
  double nearest = s, least = std::numeric_limits<double>::infinity(), error = 0;
  for (int iteration = 0; iteration < kMaxCornerNewton; ++iteration) {
    *length = s;
    error = Retry(s);
    if (!(error <= 1)) return error;
    double rate = 0;
    const double value = corners_.AtEnd(*stepper_, zero, u(), mode_, &rate);
    if (std::abs(value) >= least) {  // rounding, or a corner that is hardly passed
      *length = nearest;
      return Retry(nearest);
    }
    nearest = s;
    least = std::abs(value);
    const double next = s - value / rate;
    if (least <= kCornerRounding || !(next > 0.5 * s) || !(next <= longest) || next == s)
      return error;
    s = next;
  }
  return error;
}

/// The next trial after a step that StepOntoCorner has made, where the error control suggests h.
double Flow::StepBehindCorner(double h) {
  if (approach_.onto) {
    h = std::max(h, approach_.whole);
    approach_ = {};
  } else if (approach_.rest > 0) {
    approach_.end = end_;
    h = std::min(h, kBeyond * approach_.rest);
  }
  return h;
}

/// From the node to the next knot of a function of time [s]; what rounding leaves is at the node.
double Flow::TimeToKnot() const {
  const double time = corners_.TimeToKnot(x_);
  const bool ahead = time > kAtNode * std::max(1.0, std::abs(t_));
  return ahead ? time : std::numeric_limits<double>::infinity();
}

}  // namespace contact_flow
