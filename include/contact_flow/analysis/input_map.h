// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/derivative/linearization.h"
#include "contact_flow/piecewise_linear/piecewise_linear_map.h"

namespace contact_flow {

/// The outcome of a run under inputs on a grid, to first order: (δu_1, …, δu_K) ↦ δx(T) [2d × K m],
/// from the derivatives B_k(δx, δu_k) of its intervals,
///   δx_0 = 0,  δx_k = B_k(δx_{k−1}, δu_k).
/// Throws std::invalid_argument for an interval without derivative, with its message, and
/// std::length_error beyond `max_pieces`.
PiecewiseLinearMap InputMap(const std::vector<IntervalLinearization>& intervals,
                            std::size_t max_pieces = 20000);

}  // namespace contact_flow
