// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// Contacts that feel each other, directly or by others between them, and what moves with them: how
/// large something is is asked among these, as others may be anything.
class FeltContacts {
 public:
  FeltContacts() = default;
  /// By G = A M⁻¹ Aᵀ [k×k], and M⁻¹ Aᵀ [d×k]; what does not feel is exactly zero in them.
  FeltContacts(const Matrix& G, Matrix moved)
      : moved_(std::move(moved)), group_(static_cast<std::size_t>(G.rows())) {
    std::iota(group_.begin(), group_.end(), 0);
    for (bool changed = true; changed;) {
      changed = false;
      for (int row = 0; row < G.rows(); ++row) {
        for (int other = 0; other < row; ++other) {
          if (G(row, other) == 0 || Feels(row, other)) continue;
          Of(row) = Of(other) = std::min(Of(row), Of(other));
          changed = true;
        }
      }
    }
  }

  /// Whether contact `row` feels `other`.
  bool Feels(int row, int other) const { return Of(row) == Of(other); }

  /// The largest |value_k| [d] of what moves with contact `row`, or those that it feels.
  double Largest(int row, const VectorRef& value) const {
    double largest = 0;
    for (int other = 0; other < moved_.cols(); ++other) {
      if (!Feels(row, other)) continue;
      for (Eigen::Index k = 0; k < value.size(); ++k) {
        if (moved_(k, other) != 0) largest = std::max(largest, std::abs(value(k)));
      }
    }
    return largest;
  }

 private:
  int& Of(int row) { return group_[static_cast<std::size_t>(row)]; }
  int Of(int row) const { return group_[static_cast<std::size_t>(row)]; }

  Matrix moved_;
  std::vector<int> group_;
};

}  // namespace contact_flow
