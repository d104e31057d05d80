// SPDX-License-Identifier: BSD-3-Clause
#include "natural_spline.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace contact_flow {

/// With second derivatives m_k, zero at the ends, steps h_k and slopes δ_k of the chords, the first
/// derivatives are continuous where
///   h_{k−1} m_{k−1} + 2 (h_{k−1} + h_k) m_k + h_k m_{k+1} = 6 (δ_k − δ_{k−1}):
/// elimination of a tridiagonal matrix whose diagonal dominates.
NaturalSpline::NaturalSpline(std::vector<double> times, const std::vector<double>& values)
    : times_(std::move(times)) {
  const std::size_t n = times_.size() - 1;  // pieces between
  const auto h = [&](std::size_t k) { return times_[k + 1] - times_[k]; };
  const auto chord = [&](std::size_t k) { return (values[k + 1] - values[k]) / h(k); };
  std::vector<double> m(n + 1, 0), upper(n + 1, 0);
  for (std::size_t k = 1; k < n; ++k) {
    const double pivot = 2 * (h(k - 1) + h(k)) - h(k - 1) * upper[k - 1];
    upper[k] = h(k) / pivot;
    m[k] = (6 * (chord(k) - chord(k - 1)) - h(k - 1) * m[k - 1]) / pivot;
  }
  for (std::size_t k = n; k-- > 1;) m[k] -= upper[k] * m[k + 1];
  const double first = chord(0) - h(0) * m[1] / 6;
  const double last = chord(n - 1) + h(n - 1) * m[n - 1] / 6;
  pieces_.push_back({times_.front(), {values.front(), first, 0, 0}});
  for (std::size_t k = 0; k < n; ++k) {
    const double slope = chord(k) - h(k) * (2 * m[k] + m[k + 1]) / 6;
    pieces_.push_back({times_[k], {values[k], slope, m[k] / 2, (m[k + 1] - m[k]) / (6 * h(k))}});
  }
  pieces_.push_back({times_.back(), {values.back(), last, 0, 0}});
}

double NaturalSpline::NextKnot(double t) const {
  const std::size_t next = Find(t);
  return next < times_.size() ? times_[next] : std::numeric_limits<double>::infinity();
}

std::size_t NaturalSpline::Find(double t) const {
  return static_cast<std::size_t>(std::upper_bound(times_.begin(), times_.end(), t) -
                                  times_.begin());
}

}  // namespace contact_flow
