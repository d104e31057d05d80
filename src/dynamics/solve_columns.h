// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// B ← A⁻¹ B by the factor of A. Few columns are solved one at a time: Eigen's kernel for many
/// packs them first, which takes longer than to solve them.
inline void SolveColumns(const Eigen::LLT<Matrix>& factor, Matrix* B) {
  constexpr Eigen::Index kFew = 8;
  if (B->cols() > kFew) return factor.solveInPlace(*B);
  for (Eigen::Index c = 0; c < B->cols(); ++c) factor.solveInPlace(B->col(c));
}

/// G = WᵀW [k×k], where most of W [d×k] is zero.
inline void MultiplySparseColumns(const Matrix& W, Matrix* G) {
  thread_local std::vector<int> support;  // makes room once
  for (Eigen::Index j = 0; j < W.cols(); ++j) {
    support.clear();
    for (int r = 0; r < W.rows(); ++r) {
      if (W(r, j) != 0) support.push_back(r);
    }
    for (Eigen::Index i = j; i < W.cols(); ++i) {
      double sum = 0;
      for (int r : support) sum += W(r, i) * W(r, j);
      (*G)(i, j) = (*G)(j, i) = sum;
    }
  }
}

}  // namespace contact_flow
