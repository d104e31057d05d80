// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <cstdint>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// A factor of the mass, M = L Lᵀ. Where M is mostly zeros, as that of a machine of many limbs, it
/// is taken from the last coordinate to the first: then L is upper triangular, and has zeros where
/// no joint carries another (Featherstone 2008, Sec. 6.5), so that factor and solutions cost what
/// is in it. That is seen by M alone, whose zeros may change. Else it is Cholesky's.
class MassFactor {
 public:
  explicit MassFactor(Eigen::Index d = 0) : dense_(d) {}

  void Compute(const Matrix& mass);
  /// Whether M is positive definite.
  bool regular() const { return regular_; }
  /// Whether zeros are left out.
  bool sparse() const { return sparse_; }
  /// B ← L⁻¹ B, and L⁻ᵀ B, for one column.
  void SolveL(Eigen::Ref<Vector> b) const;
  void SolveLTransposed(Eigen::Ref<Vector> b) const;
  void SolveLTransposed(Matrix* B) const;
  /// B ← M⁻¹ B.
  void Solve(Matrix* B) const;
  /// M⁻¹ B.
  Matrix Solved(const MatrixRef& B) const;
  /// The diagonal of L.
  Vector Pivots() const {
    return sparse_ ? Vector(upper_.diagonal()) : Vector(dense_.matrixLLT().diagonal());
  }

 private:
  /// Finds what is not zero in the factor, and whether that is little.
  bool FindPattern(const Matrix& mass);
  void ComputeSparse(const Matrix& mass);

  Eigen::LLT<Matrix> dense_;
  bool regular_ = true, sparse_ = false;
  // Of the sparse one, column k of L: its diagonal, and the rows i < k from begin_[k] on.
  std::vector<int> begin_, rows_;
  std::vector<std::uint64_t> bits_;  // d words for each column
  Matrix upper_;                     // L
};

}  // namespace contact_flow
