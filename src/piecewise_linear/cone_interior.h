// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/piecewise_linear/linear_program.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The largest t ≤ 1 such that some w with |w_k| ≤ 1 has cone·w ≥ t (unit rows): the radius of the
/// largest ball of {w : cone·w ≥ 0} whose centre lies in that box, when it is below 1. +∞ without a
/// row, NaN when the linear program was not solved. `centre`, if not null, receives w.
double InteriorRadius(const Matrix& cone, Vector* centre = nullptr);

/// Cones with no larger ball have no interior.
inline constexpr double kSmallestInterior = 1e-9;

/// Does {w : cone·w ≥ 0} have interior? True when its InteriorRadius exceeds kSmallestInterior.
/// Without the linear-programming library: always true.
bool HasInterior(const Matrix& cone);

}  // namespace contact_flow
