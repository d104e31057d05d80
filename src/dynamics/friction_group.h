// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// SolveFriction of contacts that all feel each other, directly or through others.
std::vector<FrictionSolution> SolveGroup(const FrictionProblem& problem, double border);

/// All contacts open; `result` is what follows.
FrictionSolution WithoutForces(const FrictionProblem& problem, const Vector& result);

}  // namespace contact_flow
