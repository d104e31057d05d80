// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// A solution of (F4) where shares of forces decide the motion, as where a face with dependent rows
/// slides and turns: the one of equal springs, infinitely stiff, under all contacts,
///   y = (G + ε I) λ + b,      ε → 0.
/// Found for a falling ε by Newton's method on λ = proj(λ − r y) (Alart and Curnier 1991), each
/// from the one before; the limit is extrapolated from ε of 2e-6 and 1e-6, with relative errors of
/// about 1e-11 in y and 1e-9 in λ. `springs` is set. None where the method does not converge.
std::optional<FrictionSolution> SolveEqualSprings(const FrictionProblem& problem);

/// Makes a solution that SolveEqualSprings found the limit itself, by the equations of its word,
///   y_R = 0,      Zᵀ λ_R = 0 for all Z with A_Rᵀ Z = 0,
/// R the rows that vanish in it: what presses together rests together, to rounding. False, and as
/// it was, where these do not determine it.
bool SolveStiffSprings(const FrictionProblem& problem, FrictionSolution* solution);

}  // namespace contact_flow
