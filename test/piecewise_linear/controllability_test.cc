// SPDX-License-Identifier: BSD-3-Clause
// Onto, one-to-one, folded: maps whose nature is known, or known from winding numbers and samples.
#include "contact_flow/piecewise_linear/controllability.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "contact_flow/piecewise_linear/linear_program.h"
#include "test/analysis/random_conewise.h"

namespace contact_flow {
namespace {

Vector OnCircle(double angle) {
  Vector y(2);
  y << std::cos(angle), std::sin(angle);
  return y;
}

/// The plane wound around itself `times` times by `rays` equal sectors.
PiecewiseLinearMap Winding(int rays, int times) {
  std::vector<double> angles;
  Matrix images(2, rays);
  for (int k = 0; k < rays; ++k) {
    angles.push_back(2 * M_PI * k / rays);
    images.col(k) = OnCircle(times * angles.back());
  }
  return test::Fan(angles, images);
}

TEST(Controllability, DegreeTwoIsCoherentlyOrientedButNoHomeomorphism) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const PiecewiseLinearMap twice = Winding(8, 2);
  const ControllabilityReport report = AssessControllability(twice);
  EXPECT_EQ(8, report.pieces) << report.message;
  EXPECT_TRUE(report.coherently_oriented);
  EXPECT_EQ(2, report.degree);
  EXPECT_EQ(2, report.preimages);
  EXPECT_FALSE(report.homeomorphism);
  EXPECT_EQ(ControllabilityVerdict::kControllable, report.verdict) << "onto all the same";
  ASSERT_EQ(2u, report.twins.size());
  EXPECT_LE((twice(report.twins[0]) - twice(report.twins[1])).norm(), 1e-12);
  EXPECT_GT((report.twins[0].normalized() - report.twins[1].normalized()).norm(), 0.1);

  const ControllabilityReport once = AssessControllability(Winding(8, 1));
  EXPECT_TRUE(once.homeomorphism);
  EXPECT_TRUE(once.twins.empty());
  EXPECT_EQ(-2, AssessControllability(Winding(9, -2)).degree);
}

TEST(Controllability, TwoPiecesAgainstTheClosedCriterion) {
  std::mt19937 generator(5);
  int onto = 0, folded = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const int n = 2 + trial % 5;
    const Matrix A = test::RandomMatrix(n, n, &generator);
    const Matrix d = test::RandomMatrix(n, 1, &generator);
    const Matrix alpha = test::RandomMatrix(n, 1, &generator);
    const Matrix normal = alpha.transpose() / alpha.norm();
    const PiecewiseLinearMap map(
        {{A, -normal, {}, {}}, {A + d * alpha.transpose(), normal, {}, {}}});
    const double criterion = 1 + (alpha.transpose() * A.inverse() * d)(0);
    if (std::abs(criterion) < 1e-6) continue;
    const ControllabilityReport report = AssessControllability(map);
    EXPECT_EQ(criterion > 0, report.homeomorphism) << criterion;
    EXPECT_EQ(criterion > 0, report.coherently_oriented);
    EXPECT_EQ(criterion > 0 ? 1 : 0, std::abs(report.degree));
    if (criterion > 0) {
      ++onto;
      EXPECT_EQ(ControllabilityVerdict::kControllable, report.verdict);
    } else {
      ++folded;
      // A fold covers one half-space, twice.
      if (HaveLinearPrograms()) {
        ASSERT_EQ(ControllabilityVerdict::kNotControllable, report.verdict) << report.message;
        const Vector x = A.inverse() * report.unattained;
        EXPECT_GT((alpha.transpose() * x)(0), 0) << "else the first piece attains it";
      }
    }
  }
  EXPECT_GT(onto, 50);
  EXPECT_GT(folded, 50);
}

/// By brute force: the turns of the image of the circle, whether it ever turns back, and what it
/// leaves out.
struct Turning {
  double turns = 0;
  bool forth = false, back = false;
  bool onto = false;
};

Turning TurnAround(const PiecewiseLinearMap& map) {
  constexpr int kSamples = 20000, kBins = 360;
  Turning turning;
  std::vector<bool> hit(kBins, false);
  Vector previous = map(OnCircle(0));
  for (int k = 1; k <= kSamples; ++k) {
    const Vector next = map(OnCircle(2 * M_PI * k / kSamples));
    const double turn =
        std::atan2(previous(0) * next(1) - previous(1) * next(0), previous.dot(next));
    turning.turns += turn / (2 * M_PI);
    (turn > 0 ? turning.forth : turning.back) = true;
    // Everything that is swept over is attained.
    const double from = std::atan2(previous(1), previous(0));
    const int steps = 1 + static_cast<int>(std::abs(turn) * kBins);
    for (int s = 0; s <= steps; ++s) {
      const double angle = from + turn * s / steps + 4 * M_PI;
      hit[static_cast<int>(angle / (2 * M_PI) * kBins) % kBins] = true;
    }
    previous = next;
  }
  turning.onto = std::find(hit.begin(), hit.end(), false) == hit.end();
  return turning;
}

TEST(Controllability, RandomMapsOfThePlaneAgainstTheirWinding) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  std::mt19937 generator(6);
  int homeomorphisms = 0, unattained = 0, wound = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const int rays = 4 + trial % 8;
    std::vector<double> angles;
    Matrix images(2, rays);
    std::uniform_real_distribution<double> jitter(0, 0.6);
    const int times = static_cast<int>(generator() % 3);  // 0: anything
    for (int k = 0; k < rays; ++k) {
      angles.push_back(2 * M_PI * (k + jitter(generator)) / rays);
      images.col(k) = times == 0 ? Vector(test::RandomMatrix(2, 1, &generator))
                                 : OnCircle(times * angles.back() + jitter(generator));
    }
    const PiecewiseLinearMap map = test::Fan(angles, images);
    const Turning turning = TurnAround(map);
    const ControllabilityReport report = AssessControllability(map);
    EXPECT_EQ(std::lround(turning.turns), report.degree) << trial;
    const bool monotone = turning.forth != turning.back;
    EXPECT_EQ(monotone, report.coherently_oriented) << trial;
    EXPECT_EQ(monotone && std::abs(std::lround(turning.turns)) == 1, report.homeomorphism);
    if (report.verdict == ControllabilityVerdict::kControllable) {
      EXPECT_TRUE(turning.onto) << trial;
    }
    if (report.verdict == ControllabilityVerdict::kNotControllable) {
      EXPECT_FALSE(turning.onto) << trial;
      ++unattained;
    }
    homeomorphisms += report.homeomorphism;
    wound += std::abs(report.degree) == 2;
  }
  EXPECT_GT(homeomorphisms, 20);
  EXPECT_GT(wound, 10);
  if (HaveLinearPrograms()) {
    EXPECT_GT(unattained, 20);
  }
}

TEST(Controllability, RandomMapsInSpaceAgainstSamples) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  std::mt19937 generator(7);
  int homeomorphisms = 0, others = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const int n = 3 + trial % 2;
    const PiecewiseLinearMap map =
        test::SumOfFolds(test::RandomMatrix(n, n, &generator),
                         (trial % 3 == 0 ? 1.0 : 0.2) * test::RandomMatrix(n, 3, &generator),
                         test::RandomMatrix(3, n, &generator));
    const ControllabilityReport report = AssessControllability(map);
    if (report.homeomorphism) {
      ++homeomorphisms;
      // Its inverse has one of finitely many slopes everywhere: two points cannot come together.
      double slowest = std::numeric_limits<double>::infinity();
      for (const LinearPiece& piece : map.pieces()) {
        slowest = std::min(slowest, 1 / piece.matrix.inverse().norm());
      }
      for (int k = 0; k < 300; ++k) {
        const Vector a = test::RandomMatrix(n, 1, &generator);
        const Vector b = a + std::pow(10.0, -(k % 4)) * test::RandomMatrix(n, 1, &generator);
        EXPECT_GE((map(a) - map(b)).norm(), slowest * (a - b).norm() * (1 - 1e-9));
      }
    } else if (report.twins.size() == 2) {
      ++others;
      const Vector &a = report.twins[0], &b = report.twins[1];
      EXPECT_LE((map(a) - map(b)).norm(), 1e-9 * map(a).norm());
      EXPECT_GT((a - b).norm(), 1e-6 * a.norm());
    }
    if (report.unattained.size() > 0) {
      // No sample comes near its direction.
      double nearest = 2;
      for (int k = 0; k < 20000; ++k) {
        const Vector y = map(test::RandomMatrix(n, 1, &generator));
        nearest = std::min(nearest, (y.normalized() - report.unattained.normalized()).norm());
      }
      EXPECT_GT(nearest, 1e-4);
    }
  }
  EXPECT_GT(homeomorphisms, 10);
  EXPECT_GT(others, 10);
}

TEST(Controllability, MoreInputsThanStatesNeedASquareRestriction) {
  // (w₁, w₂, w₃) ↦ (|w₁| + w₂, w₃): w₂ and w₃ suffice.
  Matrix A(2, 3), B(2, 1), C(1, 3);
  A << 0, 1, 0, 0, 0, 1;
  B << 1, 0;
  C << 1, 0, 0;
  const PiecewiseLinearMap map = test::SumOfFolds(A, B, C);
  const ControllabilityReport report = AssessControllability(map);
  ASSERT_EQ(ControllabilityVerdict::kControllable, report.verdict) << report.message;
  EXPECT_TRUE(report.homeomorphism);
  ASSERT_EQ(3, report.restriction.rows());
  ASSERT_EQ(2, report.restriction.cols());
  // Every direction has its input in the restriction.
  for (int k = 0; k < 36; ++k) {
    const Vector y = OnCircle(M_PI * k / 18);
    double nearest = 2;
    for (int s = 0; s < 3600; ++s) {
      const Vector value = map(report.restriction * OnCircle(M_PI * s / 1800));
      nearest = std::min(nearest, (value.normalized() - y).norm());
    }
    EXPECT_LE(nearest, 0.05);
  }
}

/// (w₁, w₂) ↦ (w₁, unit g), where g is w₂ from 0 on, 0 down to −|w₁|, and w₂ + |w₁| below: onto,
/// though not regular.
TEST(Controllability, NoUnitMakesAStateUnreached) {
  for (const double unit : {1.0, 1e3, 1e-3, 1e-5, 1e-7, 1e-9}) {
    Matrix same = Matrix::Zero(2, 2), flat = same;
    same.diagonal() << 1, unit;
    flat(0, 0) = 1;
    std::vector<LinearPiece> pieces(5);
    pieces[0].matrix = same;
    pieces[0].cone = Eigen::RowVector2d(0, 1);
    for (int k = 0; k < 2; ++k) {
      const double side = k == 0 ? 1 : -1;
      LinearPiece& still = pieces[static_cast<std::size_t>(1 + 2 * k)];
      still.matrix = flat;
      still.cone.resize(3, 2);
      still.cone << 0, -1, side, 1, side, 0;
      LinearPiece& below = pieces[static_cast<std::size_t>(2 + 2 * k)];
      below.matrix = same;
      below.matrix(1, 0) = unit * side;
      below.cone.resize(2, 2);
      below.cone << -side, -1, side, 0;
    }
    for (LinearPiece& piece : pieces) piece.cone.rowwise().normalize();
    const ControllabilityReport report = AssessControllability(PiecewiseLinearMap(pieces));
    EXPECT_NE(ControllabilityVerdict::kNotControllable, report.verdict)
        << "unit " << unit << ": " << report.message;
  }
}

TEST(Controllability, WhatNoInputReachesIsNamed) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  // (w₁, w₂) ↦ |w₁| + |w₂| is never negative, whatever the restriction.
  const PiecewiseLinearMap sum =
      test::SumOfFolds(Matrix::Zero(1, 2), Matrix::Ones(1, 2), Matrix::Identity(2, 2));
  const ControllabilityReport report = AssessControllability(sum);
  ASSERT_EQ(ControllabilityVerdict::kNotControllable, report.verdict) << report.message;
  EXPECT_LT(report.unattained(0), 0);
  // One input, bent: it spans two dimensions and reaches no more than two rays of them.
  Matrix left(2, 1), right(2, 1);
  left << 1, 0;
  right << 0, 1;
  const Matrix one = Matrix::Ones(1, 1);
  const ControllabilityReport bent =
      AssessControllability(PiecewiseLinearMap({{left, -one, {}, {}}, {right, one, {}, {}}}));
  EXPECT_EQ(ControllabilityVerdict::kNotControllable, bent.verdict);
}

TEST(Controllability, LostDimensionsAreSetAside) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  // A plastic contact: the image lies in a plane of ℝ⁴.
  std::mt19937 generator(8);
  const Matrix plane = test::RandomMatrix(4, 2, &generator);
  std::vector<LinearPiece> pieces = Winding(8, 1).pieces();
  for (LinearPiece& piece : pieces) piece.matrix = plane * piece.matrix;
  const ControllabilityReport report = AssessControllability(PiecewiseLinearMap(pieces));
  ASSERT_EQ(2, report.reachable.cols());
  EXPECT_LE((plane - report.reachable * (report.reachable.transpose() * plane)).norm(), 1e-12);
  EXPECT_TRUE(report.homeomorphism) << report.message;
  EXPECT_EQ(0u, report.message.find("controllable in the 2 of 4 dimensions that inputs reach: "))
      << report.message;
}

}  // namespace
}  // namespace contact_flow
