// SPDX-License-Identifier: BSD-3-Clause
// Linear programs with known optima, and cones of the plane, whose interior is a matter of angles.
#include "contact_flow/piecewise_linear/linear_program.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "src/piecewise_linear/cone_interior.h"

namespace contact_flow {
namespace {

class LinearPrograms : public testing::Test {
 protected:
  void SetUp() override {
    if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  }
};

/// The cone between two rays of the plane, counterclockwise.
Matrix Sector(double from, double to) {
  Matrix cone(2, 2);
  cone << -std::sin(from), std::cos(from), std::sin(to), -std::cos(to);
  return cone;
}

TEST_F(LinearPrograms, AreAnsweredForOneObjectiveAfterAnother) {
  // y₂ ≥ y₁ ≥ 0 in the unit box.
  Matrix rows(2, 2);
  rows << -1, 1, 1, 0;
  const Vector bound = Vector::Ones(2);
  LinearProgram program(rows, -bound, bound);
  for (const auto& [a, b, expected] :
       {std::tuple(1.0, 0.0, 1.0), std::tuple(0.0, -1.0, 0.0), std::tuple(2.0, -1.0, 1.0),
        std::tuple(-1.0, 2.0, 2.0), std::tuple(-3.0, -1.0, 0.0)}) {
    const std::optional<LinearOptimum> optimum = program.Maximize(Eigen::Vector2d(a, b));
    ASSERT_TRUE(optimum);
    EXPECT_NEAR(expected, optimum->value, 1e-9);
  }
  EXPECT_THROW((void)program.Maximize(Vector::Ones(3)), std::invalid_argument);
  EXPECT_THROW(LinearProgram(rows, Vector::Ones(3), Vector::Ones(2)), std::invalid_argument);
}

/// Clp ends the process at coefficients of 1e25: programs are as before but for their scale.
TEST_F(LinearPrograms, OfAnySizeAreAnswered) {
  Matrix rows(2, 2);
  rows << -1, 1, 1, 0;
  const Vector bound = Vector::Ones(2);
  for (const double size : {1e24, 1e25, 1e30, 1e100, 1e300}) {
    LinearProgram program(size * rows, -bound, bound);
    const std::optional<LinearOptimum> optimum = program.Maximize(size * Eigen::Vector2d(2, -1));
    ASSERT_TRUE(optimum) << size;
    EXPECT_NEAR(optimum->value / size, 1, 1e-9);
    EXPECT_NEAR(optimum->point(0), 1, 1e-9);
  }
  for (const double none : {HUGE_VAL, -HUGE_VAL, std::nan("")}) {
    EXPECT_FALSE(LinearProgram(rows, -bound, bound).Maximize(none * bound));
    EXPECT_FALSE(LinearProgram(none * rows, -bound, bound).Maximize(bound));
    EXPECT_FALSE(LinearProgram(rows, -bound, none * bound).Maximize(bound));
  }
}

TEST_F(LinearPrograms, WithoutAFeasiblePointAreNotSolved) {
  const Matrix rows = Eigen::RowVector2d(-1, 0);
  const Vector one = Vector::Ones(2);
  EXPECT_FALSE(LinearProgram(rows, one, 2 * one).Maximize(one));
}

TEST_F(LinearPrograms, SectorsWithRoundingErrorsForZerosHaveInterior) {
  // Normals such as (1, −6e-17), of which Clp alone makes wrong optima.
  for (int rays : {4, 8, 12, 24}) {
    for (int k = 0; k < rays; ++k) {
      const double angle = 2 * M_PI / rays;
      const Matrix cone = Sector(k * angle, (k + 1) * angle);
      Vector centre;
      // Between the radius of the ball whose centre is on the unit circle, and √2 times that.
      const double radius = InteriorRadius(cone, &centre), unit = std::sin(angle / 2);
      EXPECT_GE(radius, unit - 1e-9) << k << " of " << rays;
      EXPECT_LE(radius, std::sqrt(2) * unit + 1e-9);
      EXPECT_GE((cone * centre).minCoeff(), radius - 1e-9);
    }
  }
}

TEST_F(LinearPrograms, InteriorOfRandomSectorsIsAMatterOfTheirAngle) {
  std::mt19937 generator(2);
  std::uniform_real_distribution<double> angle(0, 2 * M_PI), exponent(-8, 0);
  for (int trial = 0; trial < 5000; ++trial) {
    const double from = trial % 3 == 0 ? M_PI / 2 * (trial % 4) : angle(generator);
    const double width = std::pow(10, exponent(generator)) * 2.9;
    EXPECT_TRUE(HasInterior(Sector(from, from + width))) << from << " " << width;
    // Swapped rays bound the opposite sector, which a half-plane around `from` leaves out.
    Matrix none(3, 2);
    none << Sector(from + width, from), std::cos(from + width / 2), std::sin(from + width / 2);
    EXPECT_FALSE(HasInterior(none)) << from << " " << width;
  }
}

TEST_F(LinearPrograms, RandomOptimaAreNotBeatenBySamples) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 2 + trial % 4, h = 1 + trial % 7;
    Matrix rows(h, n);
    Vector objective(n);
    for (Eigen::Index i = 0; i < rows.size(); ++i) rows(i) = normal(generator);
    for (int i = 0; i < n; ++i) objective(i) = normal(generator);
    if (trial % 2 == 0) rows.col(0) *= 1e-17;
    const Vector bound = Vector::Ones(n);
    const std::optional<LinearOptimum> optimum =
        LinearProgram(rows, -bound, bound).Maximize(objective);
    ASSERT_TRUE(optimum);
    EXPECT_GE((rows * optimum->point).minCoeff(), -1e-8);
    for (int k = 0; k < 500; ++k) {
      Vector y = Vector::NullaryExpr(n, [&] { return std::tanh(2 * normal(generator)); });
      if ((rows * y).minCoeff() >= 0) {
        EXPECT_LE(objective.dot(y), optimum->value + 1e-8);
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
