// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/complementarity.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <random>

namespace contact_flow {
namespace {

/// The solution by trying all 2ⁿ supports: the definition, and an independent method.
Vector ByEnumeration(const Matrix& G, const Vector& b) {
  const int n = static_cast<int>(b.size());
  for (int mask = 0; mask < 1 << n; ++mask) {
    Matrix block = Matrix::Identity(n, n);
    Vector rhs = Vector::Zero(n);
    for (int i = 0; i < n; ++i) {
      if (!(mask >> i & 1)) continue;
      rhs(i) = -b(i);
      for (int j = 0; j < n; ++j) block(i, j) = mask >> j & 1 ? G(i, j) : 0;
    }
    const Vector z = block.fullPivLu().solve(rhs);
    const Vector w = G * z + b;
    if (z.minCoeff() >= -1e-10 && w.minCoeff() >= -1e-10) return z;
  }
  return Vector::Constant(n, std::nan(""));
}

TEST(Complementarity, AgreesWithEnumerationOnRandomProblems) {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 2000; ++trial) {
    const int n = 1 + trial % 6;
    Matrix A(n, n + 1);
    Vector b(n);
    for (int i = 0; i < n; ++i) {
      b(i) = normal(generator);
      for (int j = 0; j <= n; ++j) A(i, j) = normal(generator);
    }
    const Matrix G = A * A.transpose() + 0.01 * Matrix::Identity(n, n);
    const auto solution = SolveComplementarity(G, b);
    ASSERT_TRUE(solution);
    const Vector wanted = ByEnumeration(G, b);
    EXPECT_LE((solution->z - wanted).cwiseAbs().maxCoeff(), 1e-8 * (1 + wanted.maxCoeff()))
        << "trial " << trial;
  }
}

TEST(Complementarity, DecoupledProblemsInClosedForm) {
  const Matrix G = Vector::Map(std::array<double, 3>{2, 4, 8}.data(), 3).asDiagonal();
  Vector b(3);
  b << -2, 3, 0;
  const auto solution = SolveComplementarity(G, b);
  ASSERT_TRUE(solution);
  EXPECT_EQ(1, solution->z(0));
  EXPECT_EQ(0, solution->z(1));
  EXPECT_EQ(0, solution->z(2));
  EXPECT_EQ(ConstraintSet({0}), solution->support) << "a vanishing force is not in the support";
}

/// A mass of 1e-310 kg: the quotient overflows, which is no solution (it was one).
TEST(Complementarity, ASolutionThatIsNotFiniteIsNone) {
  Matrix G = Matrix::Identity(2, 2);
  G(1, 1) = 1e-310;
  EXPECT_FALSE(SolveComplementarity(G, Vector::Constant(2, -1.0)));
  G(1, 1) = 1;
  EXPECT_FALSE(SolveComplementarity(G, Vector::Constant(2, std::nan(""))));
  EXPECT_FALSE(SolveComplementarity(G, Vector::Constant(2, -HUGE_VAL)));
}

TEST(Complementarity, AMatrixThatIsNotPositiveSemidefiniteIsReported) {
  Vector b(2);
  b << -1, -2;  // pivoting meets the whole, singular matrix: z₁ + z₂ = 2, w = (1, 0)
  const auto singular = SolveComplementarity(Matrix::Ones(2, 2), b);
  ASSERT_TRUE(singular);
  EXPECT_NEAR(0, singular->z(0), 1e-12);
  EXPECT_NEAR(2, singular->z(1), 1e-12);
  EXPECT_FALSE(SolveComplementarity(-Matrix::Identity(2, 2), b));
  EXPECT_FALSE(SolveComplementarity(Matrix::Constant(2, 2, std::nan("")), b));
}

TEST(Complementarity, TheEmptyProblemHasTheEmptySolution) {
  EXPECT_TRUE(SolveComplementarity(Matrix(0, 0), Vector(0)));
}

}  // namespace
}  // namespace contact_flow
