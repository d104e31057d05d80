// SPDX-License-Identifier: BSD-3-Clause
// B-Newton on equations with known roots: order of convergence on and off the kink, rectangular
// ones, statuses.
#include "contact_flow/piecewise_linear/newton.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "contact_flow/piecewise_linear/linear_program.h"
#include "test/analysis/random_conewise.h"

namespace contact_flow {
namespace {

/// r(x) = A(x − x*) + b |h(x)| − b |h(x*)| + quadratic terms, h(x) = c·(x − x*) + |x − x*|² +
/// offset: root x*, on the kink for offset 0.
class FoldedEquation {
 public:
  FoldedEquation(int n, double offset, unsigned seed) : offset_(offset) {
    std::mt19937 generator(seed);
    A_ = test::RandomMatrix(n, n, &generator) + 3 * Matrix::Identity(n, n);
    b_ = 0.5 * test::RandomMatrix(n, 1, &generator);
    c_ = test::RandomMatrix(1, n, &generator);
    root = test::RandomMatrix(n, 1, &generator);
  }

  EquationValue operator()(const Vector& x, bool with_map) const {
    const Vector y = x - root;
    const double h = (c_ * y)(0) + y.squaredNorm() + offset_;
    EquationValue value;
    value.residual =
        A_ * y + b_ * (std::abs(h) - std::abs(offset_)) + 0.3 * y.cwiseProduct(y.cwiseAbs());
    value.has_map = with_map;
    if (!with_map) return value;
    const Matrix Dh = c_ + 2 * y.transpose();
    const Matrix smooth = A_ + 0.6 * Matrix(y.cwiseAbs().asDiagonal());
    if (std::abs(h) < 1e-12) {  // on the kink, but for rounding
      value.map = test::SumOfFolds(smooth, b_, Dh);
    } else {
      value.map = PiecewiseLinearMap::Linear(smooth + (h > 0 ? 1 : -1) * b_ * Dh);
    }
    return value;
  }

  Vector root;

 private:
  double offset_;
  Matrix A_, c_;
  Vector b_;
};

TEST(Newton, ConvergesQuadraticallyOnTheKinkAndOffIt) {
  std::mt19937 generator(1);
  for (double offset : {0.0, 0.4, -0.3}) {
    for (int trial = 0; trial < 20; ++trial) {
      const int n = 1 + trial % 5;
      const FoldedEquation equation(n, offset, 100 + trial);
      std::vector<double> errors;
      NewtonOptions options;
      options.tolerance = 1e-12;
      options.progress = [&](const NewtonIteration&, const Vector& x) {
        errors.push_back((x - equation.root).norm());
        return true;
      };
      const Vector start = equation.root + 0.1 * test::RandomMatrix(n, 1, &generator);
      const NewtonResult result = SolveEquation(equation, start, options);
      ASSERT_TRUE(result.ok()) << offset << " " << trial << " " << result.message;
      EXPECT_LE((result.x - equation.root).norm(), 1e-11);
      EXPECT_LE(result.iterations.size(), 10u);
      // e_{k+1} ≤ C e_k², C of the order of |A⁻¹| times the second derivatives.
      for (std::size_t k = 1; k + 1 < errors.size(); ++k) {
        EXPECT_LE(errors[k + 1], 50 * errors[k] * errors[k] + 1e-11) << offset << " " << trial;
      }
    }
  }
}

TEST(Newton, StepOnAKinkIsTheExactSolutionOfThePiecewiseLinearEquation) {
  std::mt19937 generator(2);
  for (int trial = 0; trial < 100; ++trial) {
    const int n = 2 + trial % 3;
    const PiecewiseLinearMap map = test::SumOfFolds(
        test::RandomMatrix(n, n, &generator) + 4 * Matrix::Identity(n, n),
        0.3 * test::RandomMatrix(n, 2, &generator), test::RandomMatrix(2, n, &generator));
    const Vector d = test::RandomMatrix(n, 1, &generator);
    const PiecewiseLinearStep step = SolvePiecewiseLinear(map, -map(d));
    EXPECT_LE(step.model, 1e-9);
    EXPECT_TRUE(step.in_cone);
    EXPECT_LE((map(step.d) - map(d)).norm(), 1e-9);
  }
}

TEST(Newton, ConvergesFromAfarWhereFullStepsDiverge) {
  // r = atan(2x), times 1.2 for x > 0: full steps from 3 run away.
  const NonsmoothEquation equation = [](const Vector& x, bool) {
    EquationValue value;
    const double factor = x(0) > 0 ? 1.2 : 1;
    value.residual = Vector::Constant(1, factor * std::atan(2 * x(0)));
    value.map =
        PiecewiseLinearMap::Linear(Matrix::Constant(1, 1, factor * 2 / (1 + 4 * x(0) * x(0))));
    value.has_map = true;
    return value;
  };
  const NewtonResult result = SolveEquation(equation, Vector::Constant(1, 3));
  ASSERT_TRUE(result.ok()) << result.message;
  EXPECT_NEAR(0, result.x(0), 1e-11);
  bool damped = false;
  for (const NewtonIteration& iteration : result.iterations) {
    damped |= iteration.iteration > 0 && iteration.step < 1;
  }
  EXPECT_TRUE(damped);
}

TEST(Newton, FewerConditionsTakeTheShortestStep) {
  std::mt19937 generator(3);
  const Matrix A = test::RandomMatrix(2, 5, &generator);
  const Vector r = test::RandomMatrix(2, 1, &generator);
  const Vector d = SolvePiecewiseLinear(PiecewiseLinearMap::Linear(A), r).d;
  EXPECT_LE((A * d + r).norm(), 1e-12);
  const Vector shortest = -A.transpose() * (A * A.transpose()).inverse() * r;
  EXPECT_LE((d - shortest).norm(), 1e-12);
  // A circle of roots: r = |x|² − 1, in the plane.
  const NonsmoothEquation circle = [](const Vector& x, bool) {
    EquationValue value;
    value.residual = Vector::Constant(1, x.squaredNorm() - 1);
    value.map = PiecewiseLinearMap::Linear(2 * x.transpose());
    value.has_map = true;
    return value;
  };
  const NewtonResult result = SolveEquation(circle, Eigen::Vector2d(3, 4));
  ASSERT_TRUE(result.ok());
  EXPECT_LE((result.x - Vector(Eigen::Vector2d(0.6, 0.8))).norm(), 1e-10) << "goes straight in";
}

TEST(Newton, FewerConditionsFindASolutionInItsConeWhereNoShortestOneIs) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  // f = d₁ − 2|d₂|: the shortest solutions of both pieces of f(d) = 1, (0.2, ±0.4), lie in each
  // other's cone.
  const PiecewiseLinearMap map = test::SumOfFolds(
      Eigen::RowVector2d(1, 0), Matrix::Constant(1, 1, -2), Eigen::RowVector2d(0, 1));
  EXPECT_NEAR(-0.6, map(Eigen::Vector2d(0.2, 0.4))(0), 1e-12);
  const PiecewiseLinearStep step = SolvePiecewiseLinear(map, Vector::Constant(1, -1));
  EXPECT_LE(step.model, 1e-9);
  EXPECT_NEAR(1, map(step.d)(0), 1e-9);
}

TEST(Newton, MoreConditionsEndAtTheLeastSquares) {
  std::mt19937 generator(4);
  const Matrix A = test::RandomMatrix(5, 2, &generator);
  const Vector b = test::RandomMatrix(5, 1, &generator);
  const NonsmoothEquation equation = [&](const Vector& x, bool) {
    EquationValue value;
    value.residual = A * x - b;
    value.map = PiecewiseLinearMap::Linear(A);
    value.has_map = true;
    return value;
  };
  const NewtonResult result = SolveEquation(equation, Vector::Zero(2));
  EXPECT_EQ(NewtonStatus::kStationary, result.status);
  EXPECT_LE((A.transpose() * (A * result.x - b)).norm(), 1e-9) << "normal equations";
  // Consistent ones are solved.
  const Vector root = test::RandomMatrix(2, 1, &generator);
  const NonsmoothEquation consistent = [&](const Vector& x, bool) {
    EquationValue value;
    value.residual = A * (x - root);
    value.map = PiecewiseLinearMap::Linear(A);
    value.has_map = true;
    return value;
  };
  EXPECT_TRUE(SolveEquation(consistent, Vector::Zero(2)).ok());
}

TEST(Newton, SaysWhatStoppedIt) {
  const FoldedEquation equation(2, 0, 1);
  const Vector start = equation.root + Vector::Constant(2, 0.1);
  NewtonOptions options;
  int told = 0;
  options.progress = [&](const NewtonIteration&, const Vector&) { return ++told < 3; };
  EXPECT_EQ(NewtonStatus::kCancelled, SolveEquation(equation, start, options).status);
  EXPECT_EQ(3, told);
  options.progress = nullptr;
  options.max_iterations = 1;
  EXPECT_EQ(NewtonStatus::kMaxIterations, SolveEquation(equation, start, options).status);

  // |x| + 1 has no root: a kink in the way.
  const NonsmoothEquation bowl = [](const Vector& x, bool) {
    EquationValue value;
    value.residual = Vector::Constant(1, std::abs(x(0)) + 1);
    value.has_map = true;
    const Matrix one = Matrix::Ones(1, 1);
    if (std::abs(x(0)) < 1e-9) {
      value.map = PiecewiseLinearMap({{one, one, {}, {}}, {-one, -one, {}, {}}});
    } else {
      value.map = PiecewiseLinearMap::Linear(x(0) > 0 ? one : Matrix(-one));
    }
    return value;
  };
  const NewtonResult stuck = SolveEquation(bowl, Vector::Constant(1, 2));
  EXPECT_TRUE(stuck.status == NewtonStatus::kStationary || stuck.status == NewtonStatus::kStalled);
  EXPECT_LE(std::abs(stuck.x(0)), 1e-2);

  // A wall at x < 0 beside the root of x − 0.1: steps are shortened, not lost.
  const NonsmoothEquation walled = [](const Vector& x, bool) {
    EquationValue value;
    value.defined = x(0) > 0;
    value.message = "x is negative";
    value.residual = Vector::Constant(1, std::log(std::max(x(0), 1e-300) / 0.1));
    value.map = PiecewiseLinearMap::Linear(Matrix::Constant(1, 1, 1 / x(0)));
    value.has_map = true;
    return value;
  };
  const NewtonResult inside = SolveEquation(walled, Vector::Constant(1, 2));
  ASSERT_TRUE(inside.ok()) << inside.message;
  EXPECT_NEAR(0.1, inside.x(0), 1e-11);
  EXPECT_EQ(NewtonStatus::kUndefined, SolveEquation(walled, Vector::Constant(1, -1)).status);
}

}  // namespace
}  // namespace contact_flow
