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

}  // namespace
}  // namespace contact_flow
