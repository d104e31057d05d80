// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A word of pieces of f: fᵏ(y) = A_w y on C_w = {y : fʲ(y) ∈ C_{i_{j+1}}, j < k}.
struct Word {
  std::vector<int> pieces;  ///< i₁ … i_k, applied in this order
  Matrix matrix;            ///< A_w [n×n]
  Matrix cone;              ///< C_w, unit rows
};

/// Counts linear programs against a limit.
struct ProgramBudget {
  long left = 0;
  long used = 0;
  /// False when another `count` would exceed the limit.
  bool Take(long count) {
    if (left < count) return false;
    left -= count;
    used += count;
    return true;
  }
};

/// The word of length zero.
Word EmptyWord(int n);

/// w·i.
Word Append(const PiecewiseLinearMap& map, const Word& word, int piece);

/// T f T⁻¹, with unit rows again.
PiecewiseLinearMap ChangeCoordinates(const PiecewiseLinearMap& map, const Matrix& T);

/// An upper bound of max{‖A_w y‖_∞ : ‖y‖_∞ ≤ 1, y ∈ C_w}, exact when `exact` or when it is <
/// threshold and ‖A_w‖_∞ is not: linear programs are solved as long as they may bring the bound
/// below `threshold`. Without library, or budget, ‖A_w‖_∞.
double GainBound(const Word& word, double threshold, bool exact, ProgramBudget* budget);

}  // namespace contact_flow
