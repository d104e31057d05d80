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
  Vector Pivots() const;

 private:
  /// Whether M has its zeros where it had them when the chains were found.
  bool HasZerosAsBefore(const Matrix& mass) const;
  /// Finds what carries what, and whether that leaves many zeros.
  void FindChains(const Matrix& mass);
  void ComputeSparse(const Matrix& mass);
  /// L⁻¹ and L⁻ᵀ of some columns side by side, whose rows follow one another.
  template <int kColumns>
  void SolveRowsL(double* rows) const;
  template <int kColumns>
  void SolveRowsLTransposed(double* rows) const;
  /// B ← L⁻ᵀ B, or M⁻¹ B, some columns at a time.
  void SolveColumns(bool by_both, Matrix* B) const;

  /// Place of the diagonal of column k of L.
  int Diagonal(Eigen::Index k) const { return begin_[k + 1] - 1; }

  Eigen::LLT<Matrix> dense_;
  bool regular_ = true, sparse_ = false;
  // Of the sparse one: column k of L is columns_ from begin_[k] to begin_[k + 1], in the rows of
  // its chain, the coordinates that carry k, from the first to k itself. Where rows_[e] is of the
  // chain of k, its own chain is that of k up to there.
  std::vector<int> begin_, rows_;
  std::vector<double> columns_;
  std::vector<std::uint64_t> nonzero_;  // of M's columns, above the diagonal, one after the other
};

}  // namespace contact_flow
