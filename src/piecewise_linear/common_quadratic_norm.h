// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// The rate of matrices in the norm √(yᵀPy): max over i of √λ_max(A_iᵀ P A_i, P), from the
/// eigenvalues of P and of P^{-1/2} A_iᵀ P A_i P^{-1/2}. +∞ unless P is finite, symmetric and
/// clearly positive definite.
double QuadraticRate(const std::vector<Matrix>& matrices, const MatrixRef& P);

/// One quadratic norm for several matrices.
struct CommonQuadraticNorm {
  Matrix P;         ///< [n×n], I where nothing better was found
  double rate = 0;  ///< QuadraticRate(matrices, P); < 1: a common contraction
};

/// Seeks the P > 0 of the smallest rate, a generalized eigenvalue problem: min γ, A_iᵀ P A_i ≤ γ P.
/// By the method of centres (Boyd and El Ghaoui): P is moved to the analytic centre of
///   { P : γP − A_iᵀPA_i > 0,  0 < P < I },
/// γ then to just above the rate of P; both converge. Ends early once the rate is
/// below `good_enough`.
CommonQuadraticNorm FindCommonQuadraticNorm(const std::vector<Matrix>& matrices,
                                            double good_enough = 0,
                                            const std::function<bool()>& cancelled = nullptr);

}  // namespace contact_flow
