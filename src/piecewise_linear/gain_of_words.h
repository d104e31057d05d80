// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A gain, and how much its loops grow per step along the worst of given words.
struct GainOfWords {
  Matrix gain;        ///< [m×n]
  double growth = 0;  ///< max over words of |λ(A_w)|^{1/|w|}, of the loops A_i + B_iK
};

/// That growth of a gain, [m×n].
double GrowthAlong(const PiecewiseLinearMap& step, const std::vector<std::vector<int>>& words,
                   const Matrix& gain);

/// One gain K for all pieces of x⁺ = A_i x + B_i w for which the loops grow least along `words` of
/// pieces: a lower bound on what the loop contracts by, if these words can be. A descent from each
/// of `starts`, and then from around the best end: the moduli of eigenvalues are neither smooth nor
/// convex, and a descent may end where several of them meet. Of states and inputs of like sizes.
GainOfWords FindGainOfWords(const PiecewiseLinearMap& step,
                            const std::vector<std::vector<int>>& words,
                            const std::vector<Matrix>& starts,
                            const std::function<bool()>& cancelled);

}  // namespace contact_flow
