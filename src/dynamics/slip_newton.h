// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// The rows that a word makes vanish, of contacts that are not `left_out`, and what its multipliers
/// push: λ = columns m, with m the forces in these rows.
struct HeldEquations {
  HeldEquations(const FrictionProblem& problem, const FrictionSolution& word,
                const std::vector<int>& left_out);

  std::vector<int> rows;
  Matrix columns;  // [rows of the problem × rows held]
};

/// Newton's method for the equations of a word and (F5) of the contacts `unknown`, which begin to
/// slip in space, in its multipliers and their angles together: they have no poles. From the
/// directions of *solution on, to rounding; false where it does not come there, or no digit of the
/// slips is known. Then *solution is what SolveWord makes of the directions.
bool SolveSlipEquations(const FrictionProblem& problem, const std::vector<int>& unknown,
                        FrictionSolution* solution);

}  // namespace contact_flow
