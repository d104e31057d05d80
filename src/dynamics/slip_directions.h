// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// The solutions of one word in which the contacts `unknown`, in space, begin to slip: their
/// directions d(ψ) = (cos ψ, sin ψ) are those of y_t,
///   (F5)  0 = d⊥ · y_t,  d · y_t ≥ 0.
/// One unknown: all roots (SlipDirectionsOfOne). Two: all that elimination finds
/// (SlipDirectionsOfTwo), else what Newton's method finds from a grid, as of more. To rounding.
std::vector<FrictionSolution> FindSlipDirections(const FrictionProblem& problem,
                                                 const FrictionSolution& word,
                                                 const std::vector<int>& unknown);

/// Those in which all of `unknown` have one direction: a face that slides without turning.
std::vector<FrictionSolution> FindCommonSlip(const FrictionProblem& problem,
                                             const FrictionSolution& word,
                                             const std::vector<int>& unknown);

/// Solves a word whose directions of slips that begin in space are nearly those of y_t, and makes
/// them these, by Newton's method. False, and as it was, where it does not converge.
bool PolishSlips(const FrictionProblem& problem, FrictionSolution* word);

}  // namespace contact_flow
