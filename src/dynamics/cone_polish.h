// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "cone_program.h"

namespace contact_flow {

/// Newton's method on the optimality conditions of a cone program, from a solution that tells which
/// cones are active:
///   Bᵀ y = f;   y_i = 0,   s_i = 0,   or s_i = ν_i (r, −w), |w| = r, with y_i = (r, w),
/// s = c + B z. They may be dependent, where z is not unique; then the nearest solution is taken.
/// The objective is −c·y; s may be left as it was. False, with `solution` as it was, where that
/// leads to none in the cones.
bool PolishConeSolution(const Vector& f, const Vector& c, const Matrix& B,
                        const std::vector<int>& cones, ConeSolution* solution);

}  // namespace contact_flow
