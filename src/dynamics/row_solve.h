// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// Columns of a matrix, wherever they are, and its rows in them.
struct GatheredColumns {
  std::vector<const double*> columns;
  std::vector<int> rows;
};

/// Solves, for all columns of r₁ [d] and r₂ [k],
///   M X − Aᵀ Λ = −r₁,   A X = −r₂
/// by the factor of A M⁻¹ Aᵀ and one of M > 0, from the last coordinate to the first:
///   M = L Lᵀ,   W = L⁻¹ Aᵀ,   Y = L⁻¹ r₁,   WᵀW Λ = Wᵀ Y − r₂,   X = L⁻ᵀ (W Λ − Y).
/// L and W keep most zeros of M and A (MassFactor), and rows of some columns at a time stay in
/// registers: that is quicker than to form the inverse of (1a).
void SolveByRows(const Matrix& M, const Matrix& A, const Eigen::LLT<Matrix>& delassus,
                 const GatheredColumns& r1, const GatheredColumns& r2, Matrix* X, Matrix* Lambda);

}  // namespace contact_flow
