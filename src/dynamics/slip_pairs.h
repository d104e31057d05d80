// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// Starts for the directions in which two contacts, in space, begin to slip at once: those that
/// eliminate the second one's. With D the determinant of the word's equations, affine in d_u and in
/// d_v, and x = tan(ψ_u/2), y = tan(ψ_v/2), the two
///   F_u = D d_u⊥ · y_u,  of degree 4 in x and 2 in y,     F_v = D d_v⊥ · y_v,  of 2 and 4,
/// have a root y in common where Sylvester's matrix S(x) [6×6] is singular: at no more than 20 x,
/// the eigenvalues of its companion pencil. For each of those near the real line, all directions of
/// the second contact. `pair` are the two; false where the starts are not found.
bool SlipDirectionsOfTwo(const FrictionProblem& problem, const FrictionSolution& word,
                         const std::vector<int>& pair, std::vector<FrictionSolution>* starts);

}  // namespace contact_flow
