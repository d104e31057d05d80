// SPDX-License-Identifier: BSD-3-Clause
// Rows without their zeros against the matrices that they are made of.
#include "contact_flow/dynamics/sparse_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace contact_flow {
namespace {

/// Every third entry or so is not zero; others for another k.
Matrix Holes(int rows, int cols, int k) {
  Matrix A = Matrix::Zero(rows, cols);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) {
      if ((r * r + 3 * c + k * (r + c)) % 3 == 0) A(r, c) = std::sin(1 + r + 7 * c + k);
    }
  }
  return A;
}

Vector Cosines(int size) {
  Vector w(size);
  for (int i = 0; i < size; ++i) w(i) = std::cos(1 + i * i);
  return w;
}

TEST(SparseRows, ProductsAreThoseOfTheMatrix) {
  const Matrix A = Holes(4, 7, 1);
  ASSERT_GT((A.array() == 0).count(), 10);
  const SparseRows rows(A);
  EXPECT_EQ(4, rows.rows());
  EXPECT_EQ(7, rows.cols());
  EXPECT_EQ(A, rows.Dense());
  const Vector w = Cosines(7);
  EXPECT_LT((rows * w - A * w).norm(), 1e-15);
  for (int r = 0; r < 4; ++r) {
    EXPECT_NEAR(A.row(r).dot(w), rows.Dot(r, w), 1e-15);
    EXPECT_NEAR(A.row(r).cwiseAbs().dot(w.cwiseAbs()), rows.AbsDot(r, w), 1e-15);
    EXPECT_EQ(A.row(r).cwiseAbs().maxCoeff(), rows.Largest(r));
    Vector sum = w, size = w;
    rows.AddRow(r, -2, sum);
    rows.AddAbsRow(r, size);
    EXPECT_LT((sum - (w - 2 * A.row(r).transpose())).norm(), 1e-15);
    EXPECT_LT((size - (w + A.row(r).cwiseAbs().transpose())).norm(), 1e-15);
  }
}

/// Of matrices whose zeros differ, joined before or not, and of nothing.
TEST(SparseRows, SumsAreThoseOfTheMatrices) {
  const std::vector<Matrix> A = {Holes(5, 6, 0), Holes(5, 6, 1), Holes(5, 6, 2),
                                 Matrix::Zero(5, 6)};
  ASSERT_NE(A[0].cwiseSign().cwiseAbs(), A[1].cwiseSign().cwiseAbs());
  std::vector<SparseRows> apart(A.begin(), A.end()), joined = apart;
  std::vector<SparseRows*> all;
  for (SparseRows& rows : joined) all.push_back(&rows);
  SparseRows::Join(all);
  for (std::size_t k = 0; k < A.size(); ++k) EXPECT_EQ(A[k], joined[k].Dense());
  for (std::size_t i = 0; i < A.size(); ++i) {
    for (std::size_t j = 0; j < A.size(); ++j) {
      for (const auto* rows : {&apart, &joined}) {
        SparseRows sum = (*rows)[i], other;
        sum.Add(0.5, (*rows)[j]);
        other.Add(3, (*rows)[j]);
        EXPECT_LT((sum.Dense() - (A[i] + 0.5 * A[j])).norm(), 1e-15);
        EXPECT_EQ(A[i], (*rows)[i].Dense()) << "copies share places, not numbers";
        EXPECT_LT((other.Dense() - 3 * A[j]).norm(), 1e-15);
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
