// SPDX-License-Identifier: BSD-3-Clause
// Complementarity with dependent rows.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "contact_flow/dynamics/complementarity.h"

namespace contact_flow {
namespace {

Matrix RandomMatrix(std::mt19937* generator, int rows, int columns) {
  std::normal_distribution<double> normal;
  Matrix A(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) A(i, j) = normal(*generator);
  }
  return A;
}

/// More rows than columns, G = A Aᵀ of rank r < n, b = A y in its range: the laws of the solution.
TEST(SemidefiniteComplementarity, SolvesProblemsWithDependentRows) {
  std::mt19937 generator(7);
  for (int trial = 0; trial < 500; ++trial) {
    const int rank = 1 + trial % 4, n = rank + 1 + trial % 5;
    const Matrix A = RandomMatrix(&generator, n, rank);
    const Matrix G = A * A.transpose();
    const Vector b = A * RandomMatrix(&generator, rank, 1);
    const auto solution = SolveComplementarity(G, b);
    ASSERT_TRUE(solution) << "trial " << trial;
    const Vector w = G * solution->z + b;
    // Signs are judged to 1e-13 of |b|, times the condition of the steps.
    const double zero = 1e-11 * b.cwiseAbs().maxCoeff() * (1 + solution->z.maxCoeff());
    EXPECT_GE(solution->z.minCoeff(), 0);
    EXPECT_GE(w.minCoeff(), -zero) << "trial " << trial;
    EXPECT_LE(std::abs(solution->z.dot(w)), n * zero) << "trial " << trial;
    EXPECT_LE(solution->support.Size(), rank) << "independent rows";
  }
}

TEST(SemidefiniteComplementarity, AJamHasNoSolution) {
  Matrix A(2, 1);
  A << 1, -1;  // a body between two walls that both approach
  Vector b(2);
  b << -1, -1;
  EXPECT_FALSE(SolveComplementarity(A * A.transpose(), b));
}

TEST(Independence, IsTheSquaredSineOfAnAngle) {
  Matrix A(3, 2);
  A << 1, 0, std::cos(0.1), std::sin(0.1), 2, 3;
  const Matrix G = A * A.transpose();
  EXPECT_NEAR(std::pow(std::sin(0.1), 2), Independence(G, {0}, 1), 1e-15);
  EXPECT_NEAR(0, Independence(G, {0, 1}, 2), 1e-14);
  EXPECT_EQ(1, Independence(G, {}, 2));
}

}  // namespace
}  // namespace contact_flow
