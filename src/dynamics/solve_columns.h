// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>

#include "contact_flow/types.h"

namespace contact_flow {

/// B ← A⁻¹ B by the factor of A. Few columns are solved one at a time: Eigen's kernel for many
/// packs them first, which takes longer than to solve them.
inline void SolveColumns(const Eigen::LLT<Matrix>& factor, Matrix* B) {
  constexpr Eigen::Index kFew = 8;
  if (B->cols() > kFew) return factor.solveInPlace(*B);
  for (Eigen::Index c = 0; c < B->cols(); ++c) factor.solveInPlace(B->col(c));
}

}  // namespace contact_flow
