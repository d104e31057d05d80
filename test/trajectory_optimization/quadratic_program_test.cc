// SPDX-License-Identifier: BSD-3-Clause
// The conditions of Karush, Kuhn and Tucker tell a minimum, whoever found it.
#include "src/trajectory_optimization/quadratic_program.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kInfinity;

struct Numbers {
  std::mt19937 random;
  std::normal_distribution<double> normal;
  Vector Draw(int n) {
    Vector x(n);
    for (double& entry : x) entry = normal(random);
    return x;
  }
  Matrix Draw(int m, int n) {
    Matrix A(m, n);
    for (int i = 0; i < m; ++i) A.row(i) = Draw(n).transpose();
    return A;
  }
};

TEST(QuadraticProgram, SolutionsMeetTheConditions) {
  int found = 0, refused = 0, at_bounds = 0, at_rows = 0;
  for (unsigned seed = 1; seed <= 400; ++seed) {
    Numbers numbers{std::mt19937(seed), {}};
    const int n = 1 + static_cast<int>(seed % 17), m = static_cast<int>(seed % 5);
    const int rank = seed % 3 == 0 ? (n + 1) / 2 : n;  // H is nearly singular
    const Matrix root = numbers.Draw(n, rank);
    Matrix H = root * root.transpose();
    H.diagonal().array() += 1e-9 * H.diagonal().maxCoeff();
    const Eigen::LLT<Matrix> factor(H);
    const Vector g = numbers.Draw(n);
    QuadraticProgram program{factor,
                             g,
                             -numbers.Draw(n).cwiseAbs(),
                             numbers.Draw(n).cwiseAbs(),
                             numbers.Draw(m, n),
                             numbers.Draw(m),
                             {}};
    for (int k = 0; k < n; ++k) {
      if ((seed + k) % 4 == 0) program.lower(k) = -kInfinity;
      if ((seed + k) % 7 == 0) program.upper(k) = kInfinity;
      if ((seed + k) % 11 == 0) program.lower(k) = program.upper(k) = 0;
    }
    for (int i = 0; i < m; ++i) program.equal.push_back((seed + i) % 3 == 0);
    if (m > 1 && seed % 2 == 0) {  // once more, which says nothing new
      program.A.row(1) = 2 * program.A.row(0);
      program.b(1) = 2 * program.b(0);
      program.equal[1] = program.equal[0];
    }
    const std::optional<QuadraticSolution> solution = Solve(program);
    if (!solution) {  // no constraint can be met that a row contradicts within the bounds
      ++refused;
      continue;
    }
    ++found;
    const Vector& d = solution->d;
    const double size = 1 + d.cwiseAbs().maxCoeff();
    EXPECT_TRUE((d.array() >= program.lower.array()).all() &&
                (d.array() <= program.upper.array() + 1e-12 * size).all());
    const Vector values = program.A * d + program.b;
    for (int i = 0; i < m; ++i) {
      const double z = solution->multipliers(i);
      if (program.equal[i]) {
        EXPECT_NEAR(0, values(i), 1e-6 * size) << seed;
        continue;
      }
      EXPECT_GE(values(i), -1e-6 * size) << seed;
      EXPECT_GE(z, 0);
      EXPECT_NEAR(0, z * values(i), 1e-6 * size * (1 + z)) << seed;
      at_rows += z > 0;
    }
    const Vector force = H * d + g - program.A.transpose() * solution->multipliers;
    const double noise = 1e-6 * (1 + solution->multipliers.cwiseAbs().sum() + size);
    for (int k = 0; k < n; ++k) {
      if (!solution->bounded[k]) {
        EXPECT_NEAR(0, force(k), noise) << seed;
        continue;
      }
      ++at_bounds;
      if (program.lower(k) == program.upper(k)) continue;
      if (d(k) == program.lower(k)) EXPECT_GE(force(k), -noise) << seed;
      if (d(k) == program.upper(k)) EXPECT_LE(force(k), noise) << seed;
    }
  }
  EXPECT_GT(found, 200);
  EXPECT_GT(at_bounds, 500);
  EXPECT_GT(at_rows, 50);
  EXPECT_GT(refused, 0);
}

/// What is refused has no point: two rows that exclude each other, and a row beyond the bounds.
TEST(QuadraticProgram, ContradictionsAreRefused) {
  const Eigen::LLT<Matrix> factor(Matrix::Identity(2, 2));
  const Vector g = Vector::Zero(2), one = Vector::Ones(2);
  Matrix A(2, 2);
  A << 1, 1, -1, -1;
  EXPECT_FALSE(Solve({factor, g, -5 * one, 5 * one, A, -one, {false, false}}));
  EXPECT_FALSE(Solve({factor, g, -one, one, A.topRows(1), Vector::Constant(1, -3), {false}}));
  EXPECT_FALSE(Solve({factor, g, -one, one, A.topRows(1), Vector::Constant(1, -3), {true}}));
  const std::optional<QuadraticSolution> corner =
      Solve({factor, g, -one, one, A.topRows(1), Vector::Constant(1, -2), {true}});
  ASSERT_TRUE(corner);
  EXPECT_LT((corner->d - one).norm(), 1e-12);
}

/// An entry whose bounds are one number stays there beside a row that is active.
TEST(QuadraticProgram, EqualBoundsContradictNothing) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    Numbers numbers{std::mt19937(seed), {}};
    const int n = 4;
    const Matrix root = numbers.Draw(n, n);
    Matrix H = root * root.transpose();
    H.diagonal().array() += 1e-3;
    const Eigen::LLT<Matrix> factor(H);
    const Vector g = numbers.Draw(n);
    QuadraticProgram program{factor,
                             g,
                             Vector::Constant(n, -kInfinity),
                             Vector::Constant(n, kInfinity),
                             numbers.Draw(1, n),
                             Vector::Zero(1),
                             {false}};
    program.lower(0) = program.upper(0) = 0;
    program.lower(1) = program.upper(1) = 1e-17;
    const std::optional<QuadraticSolution> solution = Solve(program);
    ASSERT_TRUE(solution) << seed;
    EXPECT_EQ(0, solution->d(0));
    EXPECT_EQ(1e-17, solution->d(1));
    EXPECT_TRUE(solution->bounded[0] && solution->bounded[1]);
  }
}

}  // namespace
}  // namespace contact_flow
