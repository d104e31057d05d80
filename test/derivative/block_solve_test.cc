// SPDX-License-Identifier: BSD-3-Clause
// The solver of the collocation systems, and the rows it is spared.
#include "src/derivative/block_solve.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <string>

#include "contact_flow/fixed_size.h"
#include "src/derivative/row_span.h"

namespace contact_flow {
namespace {

bool Solve(int m, int s, Matrix* A, Matrix* B) {
  bool solved = false;
  WithFixedSize(m, [&](auto rows) { solved = BlockSolve<decltype(rows)>::Run(rows, s, A, B); });
  return solved;
}

/// I + a random matrix whose rows sum to less than 1.
Matrix Dominant(int n) { return Matrix::Identity(n, n) + 0.9 / n * Matrix::Random(n, n); }

TEST(BlockSolve, AgreesWithTheGeneralLu) {
  std::srand(1);
  for (int m = 1; m <= 8; ++m) {
    for (int s : {1, 2, 3, 5, 8}) {
      for (int columns : {1, 2, 7}) {
        SCOPED_TRACE(std::to_string(s) + " blocks of " + std::to_string(m));
        Matrix A = Dominant(s * m), B = Matrix::Random(s * m, columns);
        const Matrix expected = A.partialPivLu().solve(B);
        ASSERT_TRUE(Solve(m, s, &A, &B));
        EXPECT_LT((B - expected).cwiseAbs().maxCoeff(), 1e-13);
      }
    }
  }
}

TEST(BlockSolve, PivotsInsideTheBlocks) {
  for (int m = 2; m <= 8; ++m) {
    // Zeros on the diagonal: cyclic permutations in the diagonal blocks.
    const int s = 3;
    Matrix A = 0.1 / (s * m) * Matrix::Random(s * m, s * m);
    A.diagonal().setZero();
    for (int k = 0; k < s; ++k) {
      for (int r = 0; r < m; ++r) A(k * m + r, k * m + (r + 1) % m) += 1;
    }
    Matrix B = Matrix::Random(s * m, 4);
    const Matrix expected = A.partialPivLu().solve(B);
    ASSERT_TRUE(Solve(m, s, &A, &B)) << m;
    EXPECT_LT((B - expected).cwiseAbs().maxCoeff(), 1e-13) << m;
  }
}

TEST(BlockSolve, RefusesASingularMatrix) {
  for (int m = 1; m <= 8; ++m) {
    for (int zero : {0, m, 3 * m - 1}) {  // in the first, the second and the last block
      Matrix A = Dominant(3 * m), B = Matrix::Random(3 * m, 2);
      A.row(zero).setZero();
      EXPECT_FALSE(Solve(m, 3, &A, &B)) << m << ' ' << zero;
    }
  }
}

bool HoldsFor(const RowSpan& span, const Matrix& M) {
  return span.Holds(M.data(), 1, static_cast<int>(M.cols()), static_cast<int>(M.rows()), 1e-12);
}

TEST(RowSpan, FindsTheRank) {
  std::srand(2);
  for (int rank = 0; rank <= 6; ++rank) {
    const Matrix combination = Matrix::Random(6, rank);
    const Matrix M = combination * Matrix::Random(rank, 40);
    Matrix sample = M.leftCols(12);
    RowSpan span;
    span.Find(&sample);
    ASSERT_EQ(span.size(), rank);
    Matrix rebuilt = Matrix::Zero(6, 40);
    for (int l = 0; l < rank; ++l) {
      rebuilt += span.combination().col(l) * M.row(span.members()[l]);
    }
    EXPECT_LT((rebuilt - M).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_TRUE(HoldsFor(span, M));
    // The same for its transpose, whose columns these rows are.
    const Matrix turned = M.transpose();
    EXPECT_TRUE(span.Holds(turned.data(), 40, 40, 1, 1e-12));
    Matrix broken = M;
    broken.rightCols(1) += Matrix::Random(6, 1);
    EXPECT_EQ(HoldsFor(span, broken), rank == 6);
  }
}

TEST(RowSpan, AllRowsAlwaysHold) {
  RowSpan span;
  span.SetAll(5);
  EXPECT_EQ(span.size(), 5);
  EXPECT_TRUE(HoldsFor(span, Matrix::Random(5, 20)));
  EXPECT_TRUE(span.combination().isIdentity(0));
}

}  // namespace
}  // namespace contact_flow
