// SPDX-License-Identifier: BSD-3-Clause
// Nonsmooth descent: known minima on and off kinks, valleys and ridges, costs of outcomes through
// impacts, and the torque law of the double pendulum.
#include "contact_flow/piecewise_linear/descent.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "contact_flow/analysis/outcome_cost.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "test/analysis/random_conewise.h"
#include "test/reference_case.h"

namespace contact_flow {
namespace {

/// J(y) = ½ |y − c|² + Σ_k b_k |h_k·y|: convex for b ≥ 0. Its derivative knows a kink within 1e-7
/// when asked for kinks, within rounding else.
NonsmoothCost Folded(const Vector& c, const Vector& b, const Matrix& h) {
  return [=](const Vector& y, CostQuery query) {
    CostValue value;
    const Vector heights = h * y;
    value.cost = 0.5 * (y - c).squaredNorm() + b.dot(heights.cwiseAbs());
    const double near = query == CostQuery::kKinks ? 1e-7 : 1e-15;
    Matrix A = (y - c).transpose();
    std::vector<int> folds;
    for (Eigen::Index k = 0; k < h.rows(); ++k) {
      if (std::abs(heights(k)) <= near) {
        folds.push_back(static_cast<int>(k));
      } else {
        A += b(k) * (heights(k) > 0 ? 1 : -1) * h.row(k);
      }
    }
    Matrix B(1, folds.size()), C(folds.size(), y.size());
    for (std::size_t k = 0; k < folds.size(); ++k) {
      B(0, k) = b(folds[k]);
      C.row(k) = h.row(folds[k]);
    }
    value.map = folds.empty() ? PiecewiseLinearMap::Linear(A) : test::SumOfFolds(A, B, C);
    value.has_map = query != CostQuery::kValue;
    return value;
  };
}

TEST(SteepestDescent, IsTheBestOfManyDirections) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 30; ++trial) {
    const PiecewiseLinearMap cost =
        test::SumOfFolds(test::RandomMatrix(1, 3, &generator), test::RandomMatrix(1, 3, &generator),
                         test::RandomMatrix(3, 3, &generator));
    const SteepestDescent steepest = FindSteepestDescent(cost);
    EXPECT_LE(steepest.d.cwiseAbs().maxCoeff(), 1 + 1e-12);
    EXPECT_NEAR(cost(steepest.d)(0), steepest.slope, 1e-9);
    double best = 0;
    for (int k = 0; k < 3000; ++k) {
      Vector d(3);
      for (double& entry : d) entry = uniform(generator);
      d /= d.cwiseAbs().maxCoeff();
      best = std::min(best, cost(d)(0));
    }
    EXPECT_LE(steepest.slope, best + 1e-9);
    EXPECT_GE(steepest.slope, best - 0.2 * (1 + std::abs(best)));
  }
}

TEST(Kinks, AreValleysOrRidges) {
  const Matrix h = Eigen::RowVector2d(3, 4);
  for (double b : {0.7, -0.7}) {
    const PiecewiseLinearMap cost =
        test::SumOfFolds(Eigen::RowVector2d(1, -2), Matrix::Constant(1, 1, b), h);
    const std::vector<Kink> kinks = FindKinks(cost);
    ASSERT_EQ(1u, kinks.size());
    EXPECT_EQ(b > 0, kinks[0].IsValley());
    EXPECT_NEAR(2 * b * 5, kinks[0].jump, 1e-12);  // |h| = 5, from both sides
    const Vector n = kinks[0].normal;
    EXPECT_NEAR(kinks[0].jump, (cost(n) + cost(-n))(0), 1e-12);
  }
  EXPECT_TRUE(FindKinks(PiecewiseLinearMap::Linear(h)).empty());
}

TEST(Descent, FindsMinimaOnAndOffKinks) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  std::mt19937 generator(2);
  for (int trial = 0; trial < 20; ++trial) {
    const int n = 2 + trial % 3;
    const Vector c = test::RandomMatrix(n, 1, &generator);
    const Matrix h = test::RandomMatrix(2, n, &generator);
    const Vector b = test::RandomMatrix(2, 1, &generator).cwiseAbs();
    const NonsmoothCost cost = Folded(c, b, h);
    const DescentResult result = Minimize(cost, 2 * test::RandomMatrix(n, 1, &generator));
    // The minimum of a convex cost, by its dual: y = c − hᵀμ, |μ_k| ≤ b_k, minimises |c − hᵀμ|;
    // found by projected gradients.
    Vector mu = Vector::Zero(2);
    const double step = 1 / (h * h.transpose()).norm();
    for (int k = 0; k < 20000; ++k) {
      mu += step * h * (c - h.transpose() * mu);
      mu = mu.cwiseMax(-b).cwiseMin(b);
    }
    const Vector exact = c - h.transpose() * mu;
    const double best = cost(exact, CostQuery::kValue).cost;
    EXPECT_LE(result.cost, best + 1e-6) << trial << " " << result.message;
    EXPECT_GE(result.cost, best - 1e-9);
    EXPECT_LE((result.y - exact).norm(), 2e-3) << trial << " " << result.message;
    for (const Kink& kink : result.kinks) EXPECT_TRUE(kink.IsValley());
  }
}

TEST(Descent, EndsInAValleyAndLeavesARidge) {
  const Matrix h = Eigen::RowVector2d(1, 0);
  const Vector c = Eigen::Vector2d(0.2, -0.5);
  const DescentResult valley =
      Minimize(Folded(c, Vector::Constant(1, 1), h), Eigen::Vector2d(1, 1));
  EXPECT_EQ(DescentStatus::kMinimum, valley.status) << valley.message;
  EXPECT_NEAR(0, valley.y(0), 1e-12);
  EXPECT_NEAR(-0.5, valley.y(1), 1e-6);
  ASSERT_EQ(1u, valley.kinks.size()) << valley.message;
  EXPECT_TRUE(valley.kinks[0].IsValley());
  // On the ridge y₁ = 0 of ½|y − c|² − |y₁| both sides fall: it is left for y₁ = 1.2.
  const NonsmoothCost ridge = Folded(c, Vector::Constant(1, -1), h);
  const std::vector<Kink> kinks = FindKinks(ridge(Eigen::Vector2d(0, -0.5), CostQuery::kKinks).map);
  ASSERT_EQ(1u, kinks.size());
  EXPECT_FALSE(kinks[0].IsValley());
  const DescentResult left = Minimize(ridge, Eigen::Vector2d(0, -0.5));
  EXPECT_EQ(DescentStatus::kMinimum, left.status) << left.message;
  EXPECT_NEAR(1.2, left.y(0), 1e-6);
  EXPECT_TRUE(left.kinks.empty());
}

/// 8 |y₁² − y₂| + (1 − y₁)² (Lewis and Overton): a curved valley whose bottom is a kink, with the
/// minimum 0 at (1, 1).
CostValue CurvedValley(const Vector& y, CostQuery query) {
  CostValue value;
  const double height = y(0) * y(0) - y(1);
  value.cost = 8 * std::abs(height) + (1 - y(0)) * (1 - y(0));
  value.has_map = query != CostQuery::kValue;
  const Matrix along = Eigen::RowVector2d(-2 * (1 - y(0)), 0),
               across = Eigen::RowVector2d(2 * y(0), -1);
  if (std::abs(height) <= (query == CostQuery::kKinks ? 1e-7 : 1e-15)) {
    value.map = test::SumOfFolds(along, Matrix::Constant(1, 1, 8), across);
  } else {
    value.map = PiecewiseLinearMap::Linear(along + (height > 0 ? 8 : -8) * across);
  }
  return value;
}

TEST(Descent, FollowsACurvedValley) {
  const DescentResult result = Minimize(CurvedValley, Eigen::Vector2d(-1.2, 1));
  EXPECT_LE(result.cost, 1e-6) << result.message;
  EXPECT_NEAR(1, result.y(0), 1e-2);
  EXPECT_NEAR(1, result.y(1), 1e-2);
  int by[3] = {0, 0, 0};
  for (const DescentIteration& iteration : result.iterations)
    ++by[static_cast<int>(iteration.method)];
  EXPECT_EQ(1, by[0]);
  EXPECT_GT(by[1], 0) << "the trust region does its part";
  EXPECT_GT(by[2], 0) << "where its steps are refused, BFGS goes on";
  for (std::size_t k = 1; k < result.iterations.size(); ++k) {
    EXPECT_LE(result.iterations[k].cost, result.iterations[k - 1].cost);
  }
}

TEST(Descent, SaysWhatStoppedIt) {
  const NonsmoothCost cost =
      Folded(Eigen::Vector2d(1, 1), Vector::Constant(1, 0.5), Eigen::RowVector2d(1, -1.5));
  DescentOptions options;
  int told = 0;
  options.progress = [&](const DescentIteration&, const Vector&) { return ++told < 3; };
  EXPECT_EQ(DescentStatus::kCancelled, Minimize(cost, Vector::Zero(2), options).status);
  EXPECT_EQ(3, told);
  options.progress = nullptr;
  options.max_iterations = 2;
  EXPECT_EQ(DescentStatus::kMaxIterations, Minimize(cost, Vector::Zero(2), options).status);
  const NonsmoothCost nowhere = [](const Vector&, CostQuery) {
    CostValue value;
    value.defined = false;
    value.message = "nowhere";
    return value;
  };
  const DescentResult undefined = Minimize(nowhere, Vector::Zero(1));
  EXPECT_EQ(DescentStatus::kUndefined, undefined.status);
  EXPECT_NE(std::string::npos, undefined.message.find("nowhere"));
}

/// The double pendulum that reaches both stops at once, its shoulder `offset` from there; the
/// shoulder torque may be chosen, and the cost is the elbow's final deviation.
OutcomeProblem ElbowProblem(const test::ReferenceCase& pendulum, double offset) {
  OutcomeProblem problem;
  problem.x = pendulum.x;
  problem.x(0) += offset;
  problem.u = pendulum.u;
  problem.duration = pendulum.duration;
  problem.unknowns = {{OutcomeUnknown::Kind::kInput, 0}};
  problem.target = pendulum.final_state;
  problem.weight = Vector::Unit(4, 1);
  problem.effort = Vector::Zero(2);
  return problem;
}

TEST(OutcomeCost, DerivativeAgreesWithQuotients) {
  const test::ReferenceCase pendulum("double_pendulum_simultaneous");
  std::mt19937 generator(1);
  for (const double torque : {0.0, -0.05}) {  // on the kink; off it, and with effort
    OutcomeProblem problem = ElbowProblem(pendulum, torque / 10);
    problem.unknowns.push_back({OutcomeUnknown::Kind::kPosition, 0});
    problem.unknowns.push_back({OutcomeUnknown::Kind::kVelocity, 1});
    problem.weight = Vector::Constant(4, 0.7);
    problem.target.setConstant(0.3);
    problem.effort = Vector::Constant(2, 0.2);
    problem.u(0) = torque;
    const NonsmoothCost cost = MakeOutcomeCost(*pendulum.system, problem);
    const Vector y = UnknownValues(*pendulum.system, problem);
    const CostValue at = cost(y, CostQuery::kKinks);
    ASSERT_TRUE(at.has_map) << at.message;
    EXPECT_EQ(torque == 0 ? 2u : 1u, at.map.pieces().size());
    for (int trial = 0; trial < 10; ++trial) {
      const Vector d = test::RandomMatrix(3, 1, &generator).normalized();
      for (double alpha : {1e-3, 1e-4, 1e-5}) {
        const double quotient = (cost(y + alpha * d, CostQuery::kValue).cost - at.cost) / alpha;
        // Second derivatives are of the order of a hundred; runs are exact to 1e-10.
        EXPECT_NEAR(quotient, at.map(d)(0), 200 * alpha + 1e-10 / alpha) << torque << " " << alpha;
      }
    }
  }
}

TEST(OutcomeCost, OfAnInitialAngleHasItsMinimumOnTheKink) {
  // The shoulder's final speed falls by −0.185 rad/s per rad of its initial angle before the
  // simultaneous impact and rises by 0.00136 after it (the reference case): that angle is a
  // minimum, in a valley. Its negative has a ridge there.
  const test::ReferenceCase pendulum("double_pendulum_simultaneous");
  OutcomeProblem problem = ElbowProblem(pendulum, 0);
  problem.unknowns = {{OutcomeUnknown::Kind::kPosition, 0}};
  problem.weight = Vector::Unit(4, 2);
  problem.target(2) = pendulum.final_state(2) - 1;  // ½ (v + 1)²: slope v′
  const NonsmoothCost cost = MakeOutcomeCost(*pendulum.system, problem);
  DescentOptions options;
  options.radius = 1e-2;
  options.tolerance = 1e-7;
  const DescentResult result = Minimize(cost, Vector::Constant(1, pendulum.x(0) - 0.004), options);
  EXPECT_EQ(DescentStatus::kMinimum, result.status) << result.message;
  EXPECT_NEAR(pendulum.x(0), result.y(0), 1e-8);
  ASSERT_EQ(1u, result.kinks.size()) << result.message;
  EXPECT_TRUE(result.kinks[0].IsValley());
  EXPECT_NEAR(0.184939 + 0.001355, result.kinks[0].jump, 1e-4);
  // Beside it the events are isolated; who asks for kinks is told of both pieces.
  const Vector beside = Vector::Constant(1, pendulum.x(0) + 1e-7);
  EXPECT_EQ(1u, cost(beside, CostQuery::kSlopes).map.pieces().size());
  EXPECT_EQ(2u, cost(beside, CostQuery::kKinks).map.pieces().size());
  problem.target(2) = pendulum.final_state(2) + 1;
  const CostValue ridge =
      MakeOutcomeCost(*pendulum.system, problem)(pendulum.x.head(1), CostQuery::kKinks);
  ASSERT_TRUE(ridge.has_map);
  ASSERT_EQ(1u, FindKinks(ridge.map).size());
  EXPECT_FALSE(FindKinks(ridge.map)[0].IsValley());
}

/// The law of Pace's thesis: the constant torque that brings the elbow back to its nominal final
/// angle, over the shoulder's initial offset. It is continuous, with a kink where both stops are
/// reached at once; its slopes there solve B_elbow(δ, τ′ δ) = 0 to either side.
TEST(TorqueLaw, HasAKinkAtTheSimultaneousImpact) {
  const test::ReferenceCase pendulum("double_pendulum_simultaneous");
  const auto torque = [&](double offset) {
    const OutcomeProblem problem = ElbowProblem(pendulum, offset);
    DescentOptions options;
    options.tolerance = 1e-10;
    const DescentResult result = Minimize(MakeOutcomeCost(*pendulum.system, problem),
                                          UnknownValues(*pendulum.system, problem), options);
    EXPECT_LE(result.cost, 1e-14) << offset << ": " << result.message;
    return result.y(0);
  };
  EXPECT_NEAR(0, torque(0), 1e-7);
  const Trajectory run = Simulate(*pendulum.system, pendulum.x, pendulum.u, pendulum.duration);
  BDerivativeOptions by_input;
  by_input.variables.inputs = true;
  const BDerivative B = DifferentiateOutcome(*pendulum.system, run, by_input);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  double slopes[2];
  for (int side = 0; side < 2; ++side) {
    const double sign = side == 0 ? -1 : 1;
    // The zero of τ ↦ B_elbow(sign, τ), monotone.
    double low = -100, high = 100;
    const auto elbow = [&](double tau) {
      Vector w = Vector::Zero(6);
      w(0) = sign;
      w(4) = tau;
      return B(w)(1);
    };
    const bool rises = elbow(high) > elbow(low);
    for (int k = 0; k < 200; ++k) {
      const double middle = 0.5 * (low + high);
      ((elbow(middle) < 0) == rises ? low : high) = middle;
    }
    const double slope = sign * 0.5 * (low + high);
    slopes[side] = slope;
    for (double size : {1e-2, 1e-3, 1e-4}) {
      EXPECT_NEAR(slope, torque(sign * size) / (sign * size), 20 * size * (1 + std::abs(slope)))
          << sign * size;
    }
  }
  std::printf("slope of the torque law: %.6f before, %.6f after the simultaneous impact\n",
              slopes[0], slopes[1]);
  EXPECT_GT(std::abs(slopes[0] - slopes[1]), 0.1);
}

}  // namespace
}  // namespace contact_flow
