// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/time_function.h"

#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "contact_flow/types.h"

namespace contact_flow {
namespace {

constexpr std::size_t kMostTimes = 10000;

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
    refuse("it is linear and periodic: its rate would jump without end; take kind: cubic");
  }
  if (times.size() < 4) refuse("a periodic one needs four times at least");
  if (values.front() != values.back()) {
    refuse("it is periodic and ends at " + std::to_string(values.back()) +
           ", not where it begins, at " + std::to_string(values.front()));
  }
}

}  // namespace

const std::vector<std::string>& TimeFunction::KindNames() {
  static const std::vector<std::string> names = {"linear", "cubic"};
  return names;
}

TimeFunction::TimeFunction(Kind kind, std::vector<double> times, std::vector<double> values,
                           bool periodic)
    : kind_(kind), times_(std::move(times)), values_(std::move(values)), periodic_(periodic) {
  Check(kind_, times_, values_, periodic_);
  if (kind_ == Kind::kCubic) {
    Spline();
    return;
  }
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
  if (kind_ != Kind::kCubic) return std::numeric_limits<double>::infinity();
  const double lap = Laps(t) * period();
  const auto next = std::upper_bound(times_.begin(), times_.end(), t - lap);
  if (next != times_.end()) return *next + lap;
  return periodic_ ? times_[1] + lap + period() : std::numeric_limits<double>::infinity();
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
  pieces_.push_back({times_[0], {values_[0], 0, 0, 0}});
  for (int k = 0; k < n; ++k) {
    const double first = m(k), last = m((k + 1) % unknowns), slope = delta(k) / h(k);
    pieces_.push_back({times_[k],
                       {values_[k], first, (3 * slope - 2 * first - last) / h(k),
                        (first + last - 2 * slope) / (h(k) * h(k))}});
  }
  pieces_.push_back({times_.back(), {values_.back(), 0, 0, 0}});
}

double TimeFunction::Laps(double t) const {
  return periodic_ ? std::floor((t - times_.front()) / period()) : 0;
}

int TimeFunction::Find(double t) const {
  const auto next = std::upper_bound(times_.begin(), times_.end(), t);
  const int k = static_cast<int>(next - times_.begin());
  // Rounding of a lap may leave its piece.
  return periodic_ ? std::clamp(k, 1, static_cast<int>(times_.size()) - 1) : k;
}

}  // namespace contact_flow
