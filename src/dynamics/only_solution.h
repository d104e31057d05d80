// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// Whether a solution of (F4) is shown to be the only one. Of two solutions that differ by δλ and
/// δy = G δλ every contact has
///   δλ_n δy_n ≤ 0,      δλ_t · δy_t ≤ κ |δλ_n| |δy_t|,
/// with κ = μ, and κ = |λ_t|/λ_n where the one at hand sticks: no more friction than it uses
/// counts. Hence δλᵀ G δλ ≤ Σ κ |δλ_n| |δy_t|, which no δλ ≠ 0 fulfils if, for some θ > 0,
///   G − ½ Σ κ (θ N Nᵀ + G T Tᵀ G/θ)
/// is positive definite, N and T being a contact's columns of 1. It is asked to be so by a
/// hundredth in normalized rows, so that what misses inequalities by next to nothing is near the
/// solution, too. (Derivation and limits: docs/theory.md.) False decides nothing.
bool IsOnlySolution(const FrictionProblem& problem, const FrictionSolution& solution);

}  // namespace contact_flow
