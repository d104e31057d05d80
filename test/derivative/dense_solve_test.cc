// SPDX-License-Identifier: BSD-3-Clause
// The solver of large collocation systems, by whatever instructions the machine has.
#include "src/derivative/dense_solve.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>

namespace contact_flow {
namespace {

/// Matrices that need their rows exchanged, of sizes beside those of vectors and blocks.
TEST(DenseSolve, LeavesNoResidual) {
  std::srand(2);
  for (int n : {1, 2, 3, 5, 13, 64, 131, 252}) {
    for (int columns : {1, 3, 74}) {
      const Matrix A = Matrix::Random(n, n), B = Matrix::Random(n, columns);
      Matrix factors = A, X = B;
      SolveDense(&factors, &X);
      ASSERT_EQ(n, X.rows());
      ASSERT_EQ(columns, X.cols());
      EXPECT_LT((A * X - B).cwiseAbs().maxCoeff(), 1e-14 * n * (1 + X.cwiseAbs().maxCoeff()))
          << n << ' ' << columns;
    }
  }
}

/// Solutions that are known: whole numbers.
TEST(DenseSolve, FindsWhatWasMultiplied) {
  const int n = 37;
  Matrix A(n, n), X(n, 2);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j)
      A(i, j) = (i * i + 3 * i * j + 7 * j) % 11 - 5 + (i + j == n - 1) * 90;
    X.row(i) << i - 10, 5 - i % 4;
  }
  Matrix B = A * X;
  SolveDense(&A, &B);
  EXPECT_LT((B - X).cwiseAbs().maxCoeff(), 1e-11);
}

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
/// To the bit, wherever the numbers lie: machines allocate at multiples of 16 bytes.
TEST(DenseSolve, DoesNotDependOnAddresses) {
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) {
    GTEST_SKIP() << "no AVX2 and FMA";
  }
  std::srand(3);
  for (int n = 2; n < 48; ++n) {
    for (int columns : {1, 2, 5, 12, 23}) {
      const Matrix A = Matrix::Random(n, n), B = Matrix::Random(n, columns);
      Matrix X[2];
      for (int shift : {0, 1}) {
        Vector left(n * n + 4), right(n * columns + 4);
        const auto place = [shift](Vector* room) {  // 0 or 16 bytes behind a multiple of 32
          const auto address = reinterpret_cast<std::uintptr_t>(room->data()) / sizeof(double);
          return room->data() + (4 - address % 4) % 4 + 2 * shift;
        };
        Eigen::Map<Matrix> factors(place(&left), n, n), solution(place(&right), n, columns);
        factors = A;
        solution = B;
        SolveDenseAvx2(factors.data(), solution.data(), n, columns);
        X[shift] = solution;
      }
      EXPECT_TRUE(X[0] == X[1]) << n << ' ' << columns;
    }
  }
}
#endif

}  // namespace
}  // namespace contact_flow
