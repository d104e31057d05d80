// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "contact_flow/constraint_set.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Solution of a linear complementarity problem.
struct ComplementaritySolution {
  Vector z;               ///< [n]
  ConstraintSet support;  ///< the indices solved as w_i = 0; z vanishes off it
};

/// Solves 0 ≤ z ⟂ w = G z + b ≥ 0 for symmetric positive semidefinite G [n×n].
/// Where G is positive definite z is unique: by Murty's least-index principal pivoting (K. G.
/// Murty, Linear Complementarity, 1988, Sec. 4.1), which is finite for every P-matrix and one step
/// per hit for a diagonal G: z_i = max(0, −b_i/G_ii). Where pivoting meets dependent rows (a pivot
/// below 1e-11 G_ii), w is still unique, for it is the gradient of the convex problem min ½ zᵀGz +
/// bᵀz, z ≥ 0, and z is one of its solutions on independent rows: by an active set (C. L. Lawson
/// and R. J. Hanson, Solving Least Squares Problems, 1974, Ch. 23). Signs are judged up to
/// rounding, 1e-13 times the largest |b_i| (1e-12 where rows are dependent): a smaller violation
/// counts as zero. Nothing where G is indefinite, G or b is not finite, or no z ≥ 0 gives w ≥ 0.
[[nodiscard]] std::optional<ComplementaritySolution> SolveComplementarity(const Matrix& G,
                                                                          const Vector& b);

/// How independent row i of G = A P Aᵀ is of the rows S, which are independent: 1 − cos² of the
/// angle between A_i and their span in the kinetic metric, in [0, 1]. `combination` [|S|], if asked
/// for, gets the y of A_i ≈ Σ_k y_k A_S(k). Where the block of S is not positive
/// definite, 0 and NaN.
double Independence(const Matrix& G, const std::vector<int>& S, int i,
                    Vector* combination = nullptr);
/// Below this, a row counts as dependent on others.
constexpr double kDependentRow = 1e-11;

}  // namespace contact_flow
