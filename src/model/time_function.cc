// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/time_function.h"

#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "contact_flow/types.h"

namespace contact_flow {
namespace {

constexpr std::size_t kMostTimes = 10000;
constexpr double kKnotRounding = 1e-14;  // of instants, relative

std::string Short(double number) {
  std::ostringstream text;
  text << number;
  return text.str();
}

[[noreturn]] void RefuseBlend(double blend, const std::string& why) {
  throw std::invalid_argument("blend is " + Short(blend) + " s: " + why);
}

void Check(TimeFunction::Kind kind, const std::vector<double>& times,
           const std::vector<double>& values, bool periodic) {
  const auto refuse = [](const std::string& why) { throw std::invalid_argument(why); };
  if (times.size() != values.size()) {
    refuse(std::to_string(times.size()) + " times and " + std::to_string(values.size()) +
           " values, expected as many of both");
  }
  if (times.size() < 2 || times.size() > kMostTimes) {
    refuse(std::to_string(times.size()) + " times, expected 2 to " + std::to_string(kMostTimes));
  }
  for (std::size_t k = 0; k < times.size(); ++k) {
    if (!std::isfinite(times[k]) || !std::isfinite(values[k])) {
      refuse("time or value " + std::to_string(k + 1) + " is not a finite number");
    }
    if (k > 0 && !(times[k] > times[k - 1])) {
      refuse("time " + std::to_string(k + 1) + " is not after the one before it");
    }
  }
  if (!periodic) return;
  if (kind == TimeFunction::Kind::kLinear) {
    refuse(
        "it is linear and periodic: its rate would jump without end; take kind: cubic, or blended");
  }
  if (times.size() < 4) refuse("a periodic one needs four times at least");
  if (values.front() != values.back()) {
    refuse("it is periodic and ends at " + std::to_string(values.back()) +
           ", not where it begins, at " + std::to_string(values.front()));
  }
}

}  // namespace

const std::vector<std::string>& TimeFunction::KindNames() {
  static const std::vector<std::string> names = {"linear", "cubic", "blended"};
  return names;
}

TimeFunction::TimeFunction(Kind kind, std::vector<double> times, std::vector<double> values,
                           bool periodic, double blend)
    : kind_(kind), times_(std::move(times)), values_(std::move(values)), periodic_(periodic) {
  Check(kind_, times_, values_, periodic_);
  if (kind_ == Kind::kCubic) Spline();
  if (kind_ == Kind::kBlended) Blend(blend);
  if (kind_ != Kind::kLinear) return;
  for (std::size_t k = 0; k + 1 < times_.size(); ++k) {
    const double slope = (values_[k + 1] - values_[k]) / (times_[k + 1] - times_[k]);
    pieces_.push_back({times_[k], {values_[k], slope, 0, 0}});
  }
  pieces_.push_back({times_.back(), {values_.back(), 0, 0, 0}});
}

std::vector<double> TimeFunction::Switches() const {
  if (kind_ != Kind::kLinear) return {};
  return {times_.begin() + 1, times_.end()};
}

double TimeFunction::NextKnot(double t) const {
  if (kind_ == Kind::kLinear) return std::numeric_limits<double>::infinity();
  const double lap = Laps(t) * period();
  const auto next = std::upper_bound(knots_.begin(), knots_.end(), t - lap);
  if (next != knots_.end()) return *next + lap;
  return periodic_ ? knots_[1] + lap + period() : std::numeric_limits<double>::infinity();
}

/// With slopes m_k and steps h_k, r̈ is continuous where
///   m_{k−1}/h_{k−1} + 2 (1/h_{k−1} + 1/h_k) m_k + m_{k+1}/h_k = 3 (Δ_{k−1}/h²_{k−1} + Δ_k/h²_k),
/// Δ_k = r_{k+1} − r_k. At rest at the ends m is zero there; periodic ones go round.
void TimeFunction::Spline() {
  const int n = static_cast<int>(times_.size()) - 1;  // pieces
  const int unknowns = periodic_ ? n : n + 1;
  const auto h = [&](int k) { return times_[(k + n) % n + 1] - times_[(k + n) % n]; };
  const auto delta = [&](int k) { return values_[(k + n) % n + 1] - values_[(k + n) % n]; };
  std::vector<Eigen::Triplet<double>> entries;
  Vector right = Vector::Zero(unknowns);
  for (int k = 0; k < unknowns; ++k) {
    if (!periodic_ && (k == 0 || k == n)) {
      entries.emplace_back(k, k, 1);
      continue;
    }
    entries.emplace_back(k, (k - 1 + unknowns) % unknowns, 1 / h(k - 1));
    entries.emplace_back(k, k, 2 / h(k - 1) + 2 / h(k));
    entries.emplace_back(k, (k + 1) % unknowns, 1 / h(k));
    right(k) = 3 * (delta(k - 1) / (h(k - 1) * h(k - 1)) + delta(k) / (h(k) * h(k)));
  }
  Eigen::SparseMatrix<double> matrix(unknowns, unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseLU<Eigen::SparseMatrix<double>> factor(matrix);
  const Vector m = factor.solve(right);
  knots_ = times_;
  pieces_.push_back({times_[0], {values_[0], 0, 0, 0}});
  for (int k = 0; k < n; ++k) {
    const double first = m(k), last = m((k + 1) % unknowns), slope = delta(k) / h(k);
    pieces_.push_back({times_[k],
                       {values_[k], first, (3 * slope - 2 * first - last) / h(k),
                        (first + last - 2 * slope) / (h(k) * h(k))}});
  }
  pieces_.push_back({times_.back(), {values_.back(), 0, 0, 0}});
}

/// Lines of slopes m_k, between them parabolas with r̈ = Δm/b; where it is at rest at an end, the
/// line beside it is as much steeper as it has b/2 less.
void TimeFunction::Blend(double b) {
  const std::size_t n = times_.size() - 1;  // lines
  if (!(b > 0) || !std::isfinite(b)) RefuseBlend(b, "it must be positive");
  const double end = periodic_ ? b / 2 : b;  // what a blend takes of the line at an end
  std::vector<double> slopes(n);
  for (std::size_t k = 0; k < n; ++k) {
    const double taken = (k == 0 ? end : b / 2) + (k + 1 == n ? end : b / 2);
    const double length = times_[k + 1] - times_[k];
    const double rounding = kKnotRounding * (std::abs(times_[k]) + std::abs(times_[k + 1]));
    if (!(taken <= length + rounding)) {
      RefuseBlend(b, "blends overlap between times " + std::to_string(k + 1) + " and " +
                         std::to_string(k + 2) + ", of whose " + Short(length) + " s they take " +
                         Short(taken));
    }
    slopes[k] = (values_[k + 1] - values_[k]) / (length - (taken - b));
  }
  // Where lines are of length 0 knots fall together, whatever rounding makes of them.
  const auto add = [this](double begin, double value, double rate, double bend) {
    if (!knots_.empty()) begin = std::max(begin, knots_.back());
    knots_.push_back(begin);
    pieces_.push_back({begin, {value, rate, bend / 2, 0}});
  };
  pieces_.push_back({times_[0], {values_[0], 0, 0, 0}});
  if (periodic_) {  // the second half of the blend that goes round
    const double bend = (slopes.front() - slopes.back()) / b;
    add(times_[0], values_[0] + bend * b * b / 8, (slopes.front() + slopes.back()) / 2, bend);
  } else {
    add(times_[0], values_[0], 0, slopes.front() / b);
  }
  for (std::size_t k = 0; k < n; ++k) {
    // A line leads to the value at its end; the last one that stops there, half a blend before.
    const bool stops = k + 1 == n && !periodic_;
    const double next = stops ? 0 : slopes[(k + 1) % n];
    const double line = times_[k] + (k == 0 ? end : b / 2);
    const double blend = times_[k + 1] - (stops ? b : b / 2);
    const auto on_line = [&](double t) {
      return values_[k + 1] + slopes[k] * (t - times_[k + 1] + (stops ? b / 2 : 0));
    };
    add(line, on_line(line), slopes[k], 0);
    add(blend, on_line(blend), slopes[k], (next - slopes[k]) / b);
  }
  add(times_[n], values_[n], 0, 0);
}

double TimeFunction::Laps(double t) const {
  return periodic_ ? std::floor((t - times_.front()) / period()) : 0;
}

int TimeFunction::Find(double t) const {
  const auto next = std::upper_bound(knots_.begin(), knots_.end(), t);
  const int k = static_cast<int>(next - knots_.begin());
  // Rounding of a lap may leave its piece.
  return periodic_ ? std::clamp(k, 1, static_cast<int>(knots_.size()) - 1) : k;
}

}  // namespace contact_flow
