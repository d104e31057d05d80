// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/guard_search.h"

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <utility>

#include "guard_interpolant.h"
#include "step_constants.h"

namespace contact_flow {
namespace {

/// The pieces' ends are up to this part of a piece from an even division; the point inside is up to
/// this part from the middle.
constexpr double kJitter = 0.07, kOffMiddle = 0.07;
/// The interpolants of pieces that hold more than this many radians of the guard are not believed:
/// by chance all that is known may lie on crests. Down to pieces of 1/128 of the first ones.
constexpr double kPhase = 6.5;
constexpr int kQuickHalvings = 7;
constexpr double kGolden = 0.6180339887498949;
/// A guard is excluded where its lower bound exceeds this many errors of the interpolant.
constexpr double kReserve = 2;
/// The error of an interpolant that resolves a guard, as a part of the guard's variation.
constexpr double kResolved = 0.02;
/// From a deviation of the rate [1/piece] to the largest one of the value: for the quintic term,
/// which vanishes in the middle with its rate 1/16, 0.0179 / (1/16).
constexpr double kRateReach = 0.3;
/// The smallest minimum that was passed is told to this part of it, where the guard
/// is not resolved.
constexpr double kMarginPrecision = 0.5;
/// Rounding of a guard, relative to its size: a state of several terms, and a formula of them.
constexpr double kGuardRounding = 1e-14;

/// Root of a function with a sign change in [a, b], to rounding.
template <class Function>
double Root(const Function& f, double a, double b, double fa, double fb) {
  if (fa == 0) return a;
  if (fb == 0) return b;
  boost::uintmax_t iterations = 100;
  const auto bracket = boost::math::tools::toms748_solve(
      f, a, b, fa, fb, boost::math::tools::eps_tolerance<double>(50), iterations);
  return 0.5 * (bracket.first + bracket.second);
}

}  // namespace

GuardSearch::GuardSearch(int n, Sampler sampler, Values values)
    : sampler_(std::move(sampler)),
      values_alone_(std::move(values)),
      values_(n, kSlots + 2),
      rates_(n, kSlots + 2),
      seen_(n, 3) {}

void GuardSearch::Sample(int slot) {
  ++samples_;
  sampler_(theta_[slot], open_[slot], values_.col(slot).data(), rates_.col(slot).data());
}

double GuardSearch::RateAt(int i, double theta) {
  ++samples_;
  sampler_(theta, ConstraintSet({i}), values_.col(kSlots).data(), rates_.col(kSlots).data());
  return rates_(i, kSlots);
}

double GuardSearch::ValueAt(int i, double theta) {
  ++samples_;
  double* value = values_.col(kSlots).data();
  if (query_->quick_values) {
    values_alone_(theta, ConstraintSet({i}), value);
  } else {
    sampler_(theta, ConstraintSet({i}), value, rates_.col(kSlots).data());
  }
  return value[i];
}

/// Whether the zero of a guard that falls all the way from `left` to `right` is behind the event
/// that was found: one sample there tells it of all guards.
bool GuardSearch::VanishesLater(int i, double left, double right) {
  const double theta = event_->theta;
  if (!event_->found || !(theta > left && theta < right)) return false;
  if (theta != sampled_event_) {
    ++samples_;
    double* value = values_.col(kSlots + 1).data();
    if (query_->quick_values) {
      values_alone_(theta, query_->guards, value);
    } else {
      sampler_(theta, query_->guards, value, rates_.col(kSlots + 1).data());
    }
    sampled_event_ = theta;
  }
  return values_(i, kSlots + 1) > 0;
}

void GuardSearch::Report(int i, double theta, bool touch) {
  if (theta > event_->theta || (theta == event_->theta && event_->found)) return;
  event_->found = true;
  event_->theta = theta;
  event_->constraint = i;
  event_->touch = touch;
}

/// A number in [−1, 1) that is different each time, for places that must not follow a pattern.
double GuardSearch::Irregular() const {
  const double turns = static_cast<double>(samples_) * kGolden;
  return 2 * (turns - std::floor(turns)) - 1;
}

/// Samples the pieces' ends, in the slots from the last one's, 1, to the first one's.
void GuardSearch::Divide(int pieces) {
  const auto place = [&](int slot, double theta) {
    theta_[slot] = theta;
    open_[slot] = query_->guards;
    Sample(slot);
  };
  place(0, 0);
  for (int k = 1; k <= pieces; ++k) {
    place(pieces + 1 - k, k < pieces ? (k + kJitter * Irregular()) / pieces : 1);
  }
  for (int i : query_->guards) {
    seen_(i, kBend) = query_->floor[i] * query_->floor[i];
    seen_(i, kTurn) = seen_(i, kSunk) = 0;
    const bool below = query_->touches && values_(i, 0) < 0;
    if (below && query_->low.Contains(i)) seen_(i, kSunk) = -values_(i, 0);
  }
  for (int slot = pieces; slot > 1; --slot) {
    const int before = slot == pieces ? 0 : slot + 1;
    for (int i : query_->guards) Learn(i, At(i, before), At(i, slot), At(i, slot - 1));
  }
}

/// How quick guard i is: its deviations from straight lines, and those of its rate.
void GuardSearch::Learn(int i, const Node& a, const Node& m, const Node& b) {
  const double slope = (b.value - a.value) / (b.theta - a.theta);
  const double bend = m.value - a.value - slope * (m.theta - a.theta), turn = m.rate - slope;
  seen_(i, kBend) += bend * bend;
  seen_(i, kTurn) += turn * turn;
}

void GuardSearch::Run(const GuardQuery& query, double* margin, LocatedEvent* event) {
  query_ = &query;
  margin_ = margin;
  event_ = event;
  samples_ = 0;
  sampled_event_ = -1;
  finest_ = 1;
  int top = std::min(query.pieces, kMaxPieces);
  shortest_ = std::ldexp(1.0 / top, -kQuickHalvings);
  Divide(top);
  while (top > 0 && theta_[0] < event->theta) {
    if (samples_ > query.max_samples) {
      event->found = false;
      event->theta = theta_[0];
      event->constraint = *open_[top].begin();
      return;
    }
    const int middle = top + 1;
    const double length = theta_[top] - theta_[0];
    theta_[middle] = theta_[0] + length * (0.5 + kOffMiddle * Irregular());
    open_[middle] = open_[top];
    Sample(middle);
    const bool last = middle + 1 == kSlots || std::ldexp(length, kMaxHalvings) < 1;
    ConstraintSet open;
    for (int i : open_[top]) {
      if (!Settle(i, middle, top, last)) open.Insert(i);
    }
    if (open.Empty()) {
      values_.col(0) = values_.col(top);
      rates_.col(0) = rates_.col(top);
      theta_[0] = theta_[top];
      --top;
    } else {
      open_[top] = open_[middle] = open;
      finest_ = std::min(finest_, length / 2);
      top = middle;
    }
  }
}

/// Whether guard i needs no further look on the piece from slot 0 to `end`.
bool GuardSearch::Settle(int i, int middle, int end, bool last) {
  const Node a = At(i, 0), m = At(i, middle), b = At(i, end);
  const double length = b.theta - a.theta;
  Learn(i, a, m, b);
  const bool quick = query_->quick && length > shortest_ && !last &&
                     length * length * seen_(i, kTurn) > kPhase * kPhase * seen_(i, kBend);
  if (quick) return false;
  const CubicPiece whole(length, a.value, a.rate, b.value, b.rate);
  const double s = (m.theta - a.theta) / length;
  const double error = std::max(std::abs(m.value - whole.Value(s)),
                                kRateReach * std::abs(length * m.rate - whole.Rate(s)));
  const CubicPiece left(m.theta - a.theta, a.value, a.rate, m.value, m.rate);
  const CubicPiece right(b.theta - m.theta, m.value, m.rate, b.value, b.rate);
  const double lowest = std::min(left.Lowest(), right.Lowest());
  const double highest = std::max(left.Highest(), right.Highest());
  const double floor = query_->floor[i];
  const bool excluded = lowest > kReserve * error + floor;
  if (excluded && lowest - error >= *margin_) return true;
  const double noise =
      std::max(floor, kGuardRounding * std::max(std::abs(lowest), std::abs(highest)));
  const bool flat = highest - lowest <= noise;
  const bool resolved = error <= std::max(kResolved * (highest - lowest), noise) &&
                        (flat || (left.TurnsAsEndsTell() && right.TurnsAsEndsTell()));
  if (excluded && !resolved && lowest - error > kMarginPrecision * *margin_) {
    // No zero; of a dip that may be here a lower bound is enough.
    if (m.value < std::min(a.value, b.value)) *margin_ = std::min(*margin_, lowest - error);
    return true;
  }
  if (!resolved && !last) return false;
  SearchHalf(i, a, m, left.Lowest() - error);
  if (m.theta < event_->theta) SearchHalf(i, m, b, right.Lowest() - error);
  return true;
}

/// The guard has one turn at most from `begin` to `end`; the stretch after it, or the whole, is
/// where it falls.
void GuardSearch::SearchHalf(int i, const Node& begin, const Node& end, double lower_bound) {
  const double floor = query_->floor[i];
  const bool dips = begin.rate < 0 && end.rate > 0;
  // A guard below zero by less than this has not vanished. One that was left below zero by the
  // event that the step begins with has not come down.
  const bool falls_on = end.theta == 1 && end.rate < 0 && query_->falling.Contains(i);
  const double sunk = seen_(i, kSunk);
  const double least = falls_on || sunk > floor ? sunk + kStandsStill * floor : floor;
  const bool comes_back = query_->low.Contains(i) && std::min(begin.rate, end.rate) < -query_->fall;
  if (end.value >= -least && !comes_back &&
      (!dips || lower_bound > std::max(kTouchReach * floor, *margin_))) {
    return;
  }
  const auto value_at = [&](double theta) { return ValueAt(i, theta); };
  const auto rate_at = [&](double theta) { return RateAt(i, theta); };
  double turn = end.theta, value_turn = end.value;
  if (begin.rate * end.rate < 0) {
    turn = Root(rate_at, begin.theta, end.theta, begin.rate, end.rate);
    value_turn = value_at(turn);
  }
  const bool falls = begin.value > floor && begin.value - value_turn > kStandsStill * floor;
  const bool dip = dips && (falls || !query_->low.Contains(i));
  double left = begin.theta, value_left = begin.value;
  const double stops[2] = {turn, end.theta};
  const double values[2] = {value_turn, end.value};
  for (int part = 0; part < 2; ++part) {
    const bool passes = comes_back && value_left > 0 && values[part] < 0;
    if (values[part] < -least || passes) {
      if (value_left > 0 && VanishesLater(i, left, stops[part])) return;
      const double root =
          value_left <= 0 ? left : Root(value_at, left, stops[part], value_left, values[part]);
      if (values[part] < -least || RateAt(i, root) < -query_->fall) return Report(i, root, false);
    }
    if (part == 0 && dip && query_->touches && value_turn <= kTouchReach * floor) {
      return Report(i, turn, true);
    }
    left = stops[part];
    value_left = values[part];
  }
  const double depth = std::max(begin.value, end.value) - value_turn;
  if (dip && depth > kGuardRounding * std::abs(value_turn)) {
    *margin_ = std::min(*margin_, std::max(value_turn, 0.0));
  }
}

}  // namespace contact_flow
