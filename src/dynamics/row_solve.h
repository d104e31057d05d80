// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// Solves, for all columns of r₁ [d] and r₂ [k],
///   M X − Aᵀ Λ = −r₁,   A X = −r₂
/// by the factor of A M⁻¹ Aᵀ and one of M > 0, from the last coordinate to the first:
///   M = L Lᵀ,   W = L⁻¹ Aᵀ,   Y = L⁻¹ r₁,   WᵀW Λ = Wᵀ Y − r₂,   X = L⁻ᵀ (W Λ − Y).
/// L and W keep most zeros of M and A (MassFactor), and rows of some columns at a time stay in
/// registers: that is quicker than to form the inverse of (1a). All its room is made once.
class RowSolver {
 public:
  /// No columns; r₂ is what `rows` [k] names of the matrices that Add is given.
  void Start(const std::vector<int>& rows);
  /// More columns, of r₁ and of r₂, which stay where they are until Solve.
  void Add(const Matrix& momentum, const Matrix& constraint);
  /// X [d×·] and Λ [k×·], which have room for all columns.
  void Solve(const Matrix& M, const Matrix& A, const Eigen::LLT<Matrix>& delassus, Matrix* X,
             Matrix* Lambda);

 private:
  static constexpr int kWidth = 12;  // columns that are solved at once: six registers of two
  using Row = Eigen::Array<double, kWidth, 1>;
  using Rows = Eigen::Array<double, kWidth, Eigen::Dynamic>;  // one behind another

  /// A matrix by what is not zero in its rows.
  class NonzeroRows {
   public:
    /// Of `entry(i, j)`, and j from `first(i)` up to `end(i)`.
    template <class Entry, class First, class End>
    void Fill(int rows, int columns, const Entry& entry, const First& first, const End& end);
    /// Row i of this matrix times B.
    Row Multiply(int i, const Rows& B) const;

   private:
    struct Nonzero {
      int column;
      double value;
    };
    std::vector<int> begin_;
    std::vector<Nonzero> entries_;
  };

  static void Gather(const std::vector<const double*>& columns, const std::vector<int>& row,
                     int first, int count, Rows* rows);
  static void Scatter(const Rows& rows, int first, int count, Matrix* to);
  void Factorize(const Matrix& M, const Matrix& A);
  void SolveDelassus(const Matrix& factor);

  std::vector<const double*> momentum_, constraint_;  // columns
  std::vector<int> all_, rows_;                       // 0 … d − 1, and those of r₂
  Matrix L_, W_;                                      // upper triangular [d×d], [d×k]
  Vector pivots_;                                     // reciprocals of the diagonal of L
  Vector delassus_pivots_;                            // … and of the factor of WᵀW
  std::vector<int> support_;
  NonzeroRows above_, below_;    // what is not zero in rows of L and Lᵀ, without the diagonal
  NonzeroRows reach_, reached_;  // in rows of W and Wᵀ
  Rows x_, y_, force_;
};

}  // namespace contact_flow
