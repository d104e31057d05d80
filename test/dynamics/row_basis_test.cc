// SPDX-License-Identifier: BSD-3-Clause
// Which of dependent rows are taken for a basis.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "src/dynamics/dependent_rows.h"

namespace contact_flow {
namespace {

/// Rows of one length, of which more have one direction than there are dimensions: rounding of
/// their Gram matrix takes no other ones, and no forces jump with it.
TEST(RowBasis, IsTheSameWhateverRoundingIs) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  for (int repeat = 0; repeat < 200; ++repeat) {
    Matrix rows = Matrix::NullaryExpr(6, 4, [&] { return normal(random); });
    rows.rowwise().normalize();
    const Matrix G = rows * rows.transpose();
    const RowBasis basis = FindRowBasis(G);
    ASSERT_EQ(4U, basis.rows.size());
    EXPECT_LT((G * basis.inverse * G - G).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((rows.transpose() * basis.freedom).cwiseAbs().maxCoeff(), 1e-6);
    for (int other = 0; other < 5; ++other) {
      Matrix noise = Matrix::NullaryExpr(6, 6, [&] { return 1e-15 * normal(random); });
      noise += noise.transpose().eval();
      EXPECT_EQ(basis.rows, FindRowBasis(G + noise).rows) << repeat;
    }
  }
}

/// What nothing moves is in no basis.
TEST(RowBasis, LeavesOutARowOfZeros) {
  Matrix rows = Matrix::Zero(4, 2);
  rows.row(1) << 3, 4;
  rows.row(2) << 0, 1;
  rows.row(3) << 1, 0;
  const RowBasis basis = FindRowBasis(rows * rows.transpose());
  EXPECT_EQ(2U, basis.rows.size());
  for (int row : basis.rows) EXPECT_NE(0, row);
}

}  // namespace
}  // namespace contact_flow
