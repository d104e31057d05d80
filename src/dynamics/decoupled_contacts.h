// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"

namespace contact_flow {

/// Blocks A_i P A_jᵀ below this part of √(N_i P N_iᵀ N_j P N_jᵀ) vanish.
constexpr double kNoBlock = 1e-12;

/// Whether no contact feels a force at another one at x: the full blocks A_i P A_jᵀ of all pairs,
/// normal and tangential, vanish.
inline bool AreDecoupled(const MechanicalSystem& system, const VectorRef& x,
                         const ConstraintSet& contacts) {
  const int nq = system.num_positions();
  const InverseInertia inertia(system, x.head(nq), x.tail(system.dof()));
  const FrictionFrame frame(system, inertia, contacts);
  const FrictionProblem& problem = frame.problem();
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const int row = problem.Row(i), other = problem.Row(j);
      const auto block = problem.G.block(row, other, 1 + problem.contacts[i].dimension,
                                         1 + problem.contacts[j].dimension);
      const double own = std::sqrt(problem.G(row, row) * problem.G(other, other));
      if (block.cwiseAbs().maxCoeff() > kNoBlock * own) return false;
    }
  }
  return true;
}

}  // namespace contact_flow
