// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "contact_flow/fixed_size.h"

namespace contact_flow {
namespace {

/// Each entry is a sum of at most 9 products below 1 in some order: rounding of 9² ε at most.
constexpr double kRounding = 81 * 2.3e-16;

TEST(MultiplyFewRows, IsTheProduct) {
  std::srand(1);
  for (int rows = 0; rows <= 10; ++rows) {
    for (int terms = 0; terms <= 9; terms += 3) {
      for (int columns = 0; columns <= 5; ++columns) {
        const Matrix A = Matrix::Random(rows, terms);
        Matrix B = Matrix::Random(terms, columns);
        if (terms > 0 && columns > 1) B.row(0).setZero();  // both of two neighbours
        if (terms > 1 && columns > 1) B(1, 0) = 0;         // one of them
        Matrix product = Matrix::Constant(2, 2, 7);        // of another size before
        MultiplyFewRows(-1, A, B, &product);
        ASSERT_EQ(product.rows(), rows);
        ASSERT_EQ(product.cols(), columns);
        if (product.size() == 0) continue;
        EXPECT_LE((product + A.lazyProduct(B)).cwiseAbs().maxCoeff(), kRounding)
            << rows << ' ' << terms << ' ' << columns;
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
