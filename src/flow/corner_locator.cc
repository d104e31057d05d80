// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/corner_locator.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace contact_flow {
namespace {

/// Where a corner is passed, as a part of the step; the share of a function that is left there.
constexpr double kAt = 1e-12;
/// Part of a step along which a rate is a quotient.
constexpr double kQuotient = 1e-6;
/// A cubic that stays this far within a piece, relative to its range, excludes a passing.
constexpr double kRoom = 0.1;
constexpr int kMaxHalvings = 100;

/// The corner that is passed first on the way between two pieces.
double FirstCorner(const std::vector<double>& corners, int from, int to) {
  return corners[static_cast<std::size_t>(to > from ? from : from - 1)];
}

}  // namespace

CornerLocator::CornerLocator(const MechanicalSystem& system)
    : functions_(system), x_(system.state_size()), samples_(functions_.size(), kSamples) {}

void CornerLocator::ValuesAndRates(const Vector& x, const VectorRef& xdot, double h, Vector* value,
                                   Vector* rate) {
  Evaluate(x, value);
  x_ = x + kQuotient * h * xdot;
  Evaluate(x_, &moved_);
  *rate = (moved_ - *value) / kQuotient;
}

/// Whether the cubics of values and rates at the ends leave it open.
bool CornerLocator::MayPass() const {
  for (int i = 0; i < functions_.size(); ++i) {
    const double b[] = {begin_(i), begin_(i) + begin_rate_(i) / 3, end_(i) - end_rate_(i) / 3,
                        end_(i)};
    if (!std::isfinite(b[0]) || !std::isfinite(b[1] + b[2]) || !std::isfinite(b[3])) continue;
    const auto [low, high] = std::minmax_element(b, b + 4);
    const double room = kRoom * (*high - *low);
    const std::vector<double>& corners = functions_.corners(i);
    const auto first = std::upper_bound(corners.begin(), corners.end(), *low - room);
    if (first != corners.end() && *first < *high + room) return true;
  }
  return false;
}

double CornerLocator::ValueAt(Stepper* stepper, int i, double theta) {
  stepper->Interpolate(theta, x_.data());
  Evaluate(x_, &value_);
  return value_(i);
}

/// Of r − corner, which has different signs at the ends, by the Illinois method.
double CornerLocator::Root(Stepper* stepper, int i, double corner, double begin, double end) {
  double low = ValueAt(stepper, i, begin) - corner;
  double high = ValueAt(stepper, i, end) - corner;
  int kept = 0;
  for (int k = 0; k < kMaxHalvings && end - begin > kAt; ++k) {
    double at = begin + (end - begin) * low / (low - high);
    if (!(at > begin && at < end)) at = 0.5 * (begin + end);
    const double value = ValueAt(stepper, i, at) - corner;
    if (std::abs(value) <= 0.1 * kAt) return at;
    if ((value > 0) == (high > 0)) {
      end = at;
      high = value;
      if (kept == 1) low *= 0.5;
      kept = 1;
    } else {
      begin = at;
      low = value;
      if (kept == -1) high *= 0.5;
      kept = -1;
    }
  }
  return 0.5 * (begin + end);
}

/// Where the parabola through sample j and its neighbours turns, in samples from j on, if it does
/// so on another piece; else 0.
double CornerLocator::Turn(int i, int j) const {
  if (j == 0 || j + 1 == kSamples) return 0;
  const double here = samples_(i, j);
  const double before = samples_(i, j - 1), behind = samples_(i, j + 1);
  const double bend = before - 2 * here + behind, slope = 0.5 * (behind - before);
  const double turn = -slope / bend;
  if (!(std::abs(turn) < 1)) return 0;
  const double there = here + 0.5 * slope * turn;
  return functions_.Piece(i, there) != functions_.Piece(i, here) ? turn : 0;
}

std::optional<CornerLocator::Zero> CornerLocator::FirstZero(Stepper* stepper, int i) {
  constexpr double kStep = 1.0 / (kSamples - 1);
  std::optional<int> last;
  double known = 0;  // where `last` was
  std::optional<Zero> zero;
  const auto look = [&](double theta, double value) {
    const std::optional<int> piece = functions_.Piece(i, value);
    if (zero || !piece) return;
    if (last && *last != *piece) {
      const double corner = FirstCorner(functions_.corners(i), *last, *piece);
      zero = Zero{i, corner, Root(stepper, i, corner, known, theta)};
    }
    last = piece;
    known = theta;
  };
  for (int j = 0; j < kSamples; ++j) {
    const double turn = Turn(i, j), theta = (j + turn) * kStep;
    if (turn < 0) look(theta, ValueAt(stepper, i, theta));
    look(j * kStep, samples_(i, j));
    if (turn > 0) look(theta, ValueAt(stepper, i, theta));
  }
  return zero;
}

std::optional<CornerLocator::Zero> CornerLocator::Locate(Stepper* stepper, const VectorRef& u,
                                                         ContactMode mode) {
  u_ = u;
  mode_ = mode;
  const double h = stepper->step();
  ValuesAndRates(stepper->begin(), stepper->begin_field(), h, &begin_, &begin_rate_);
  ValuesAndRates(stepper->end(), stepper->end_field(), h, &end_, &end_rate_);
  if (!MayPass()) return std::nullopt;
  if (!stepper->extended()) stepper->Extend();
  for (int j = 0; j < kSamples; ++j) {
    stepper->Interpolate(j / (kSamples - 1.0), x_.data());
    Evaluate(x_, &value_);
    samples_.col(j) = value_;
  }
  std::optional<Zero> first;
  for (int i = 0; i < samples_.rows(); ++i) {
    const std::optional<Zero> zero = FirstZero(stepper, i);
    if (zero && (!first || zero->theta < first->theta)) first = zero;
  }
  return first;
}

double CornerLocator::AtEnd(const Stepper& stepper, const Zero& zero, const VectorRef& u,
                            ContactMode mode, double* rate) {
  u_ = u;
  mode_ = mode;
  const double h = stepper.step();
  ValuesAndRates(stepper.end(), stepper.end_field(), h, &end_, &end_rate_);
  *rate = end_rate_(zero.function) / h;
  return end_(zero.function) - zero.corner;
}

}  // namespace contact_flow
