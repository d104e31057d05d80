// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "contact_flow/fixed_size.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The fastest rate [1/s] of ÿ = K y + D ẏ, jacobian = [K D]: the spectral radius of its companion
/// matrix, by power iteration. An estimate, to begin with.
inline double FastestRate(const Matrix& jacobian) {
  constexpr int kIterations = 16, kDiscarded = 4, kBetweenNorms = 4;
  const Eigen::Index d = jacobian.rows();
  Vector y(4 * d);  // and the one before, by turns
  double *from = y.data(), *to = from + 2 * d;
  for (Eigen::Index i = 0; i < 2 * d; ++i) from[i] = 1 + 0.37 * static_cast<double>(i % 5);
  double growth = 0;
  for (int k = kBetweenNorms; k <= kIterations; k += kBetweenNorms) {
    WithFixedSize(static_cast<int>(d), [&](auto rows) {
      for (int l = 0; l < kBetweenNorms; ++l) {
        std::copy(from + d, from + 2 * d, to);
        ColumnSum sum(rows, to + d);
        for (Eigen::Index c = 0; c < 2 * d; ++c) sum.Add(from[c], jacobian.data() + c * d);
        sum.WriteTo(to + d);
        std::swap(from, to);
      }
    });
    Eigen::Map<Vector> now(from, 2 * d);
    const double factor = now.norm();
    if (!(factor > 0) || !std::isfinite(factor)) return 0;
    if (k > kDiscarded) growth += std::log(factor);
    now /= factor;
  }
  return std::exp(growth / (kIterations - kDiscarded));
}

}  // namespace contact_flow
