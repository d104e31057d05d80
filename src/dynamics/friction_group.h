// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// SolveFriction with the letters until now, by contact, which are tried where not all words are:
/// where more than four contacts depend on each other. Empty for none.
std::vector<FrictionSolution> SolveFrictionFrom(const FrictionProblem& problem, double border,
                                                const std::vector<Letter>& before);

/// The same of contacts that all feel each other, directly or through others.
std::vector<FrictionSolution> SolveGroup(const FrictionProblem& problem, double border,
                                         const std::vector<Letter>& before);

}  // namespace contact_flow
