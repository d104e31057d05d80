// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Gains and the norm in which they contract.
struct GainsAndNorm {
  std::vector<Matrix> gains;  ///< [m×n] each
  Matrix P;                   ///< [n×n]
  double rate = 0;            ///< max |A_i + B_iK|_P
};

/// Norm and gains at once of x⁺ = A_i x + B_i w: one gain for all pieces, or one for each.
GainsAndNorm FindGainsAndNorm(const PiecewiseLinearMap& step, bool one_for_each, double good_enough,
                              const std::function<bool()>& cancelled);

}  // namespace contact_flow
