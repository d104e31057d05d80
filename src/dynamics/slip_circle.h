// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// All directions d, |d| = 1, in which contact `one`, in space, may begin to slip while the others
/// have the letters and directions of `word`: with D the determinant of the word's equations,
///   D(d) = δ₀ + δ · d,   D y_t = α + (β₁, β₂) · d,   F(d) = D d⊥ · y_t = 0,
/// F has no poles, and is a quartic in the tangent of half the angle. Its real roots are bracketed
/// by those of its derivatives: none is missed, however near to another one, or to one of D, but
/// those at which D is zero to rounding. Whether inequalities hold, d · y_t ≥ 0, is left to see.
std::vector<Eigen::Vector2d> SlipDirectionsOfOne(const FrictionProblem& problem,
                                                 const FrictionSolution& word, int one);

}  // namespace contact_flow
