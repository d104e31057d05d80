// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/piecewise_linear/stability.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What a loop is known to contract by.
struct LoopGrowth {
  double above = 0;       ///< growth per step, at most
  std::vector<int> word;  ///< of pieces of the step, that grows by more than `below`; or none
};

/// Of the loop that one gain closes around a step: by few words at a time, for growths nearer and
/// nearer to what can be proven, the first just above `below`, by which some words grow that
/// need not be possible. That the step is one map is not checked again.
LoopGrowth GrowthOf(const PiecewiseLinearMap& step, const Matrix& gain, double below,
                    const StabilityOptions& stability);

}  // namespace contact_flow
