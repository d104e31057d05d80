// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

namespace contact_flow {
namespace test {

/// The first t in (0, end] with f(t) < −10⁻⁹, by even steps and bisection; infinite if none.
template <class Function>
double FirstZero(const Function& f, double step, double end) {
  for (long k = 1; k * step <= end; ++k) {
    double left = (k - 1) * step, right = k * step;
    if (f(right) >= -1e-9) continue;
    for (int halving = 0; halving < 50; ++halving) {
      const double middle = (left + right) / 2;
      (f(middle) < 0 ? right : left) = middle;
    }
    return right;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace test
}  // namespace contact_flow
