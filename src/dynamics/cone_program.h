// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// A solution of a cone program: z, the slack s = c + B z, and the dual y, Bᵀ y = f.
struct ConeSolution {
  Vector z, slack, dual;
};

/// min f·z subject to s = c + B z ∈ K, a product of second-order cones {(r, w) : |w| ≤ r} of the
/// sizes `cones` (1: r ≥ 0), in the order of the rows. By a primal-dual method with Nesterov and
/// Todd's scaling and Mehrotra's steps (L. Vandenberghe, The CVXOPT linear and quadratic cone
/// program solvers, 2010), from `start`, which has to give an s in the interior; to a duality gap
/// of rounding: Newton's method on the equations of the cones that are active ends what scaling can
/// no longer resolve. Where solutions are not unique, one inside their set. The columns of B must
/// be independent. Nothing where it does not converge: f·z is not bounded below.
[[nodiscard]] std::optional<ConeSolution> SolveConeProgram(const Vector& f, const Vector& c,
                                                           const Matrix& B,
                                                           const std::vector<int>& cones,
                                                           const Vector& start);

}  // namespace contact_flow
