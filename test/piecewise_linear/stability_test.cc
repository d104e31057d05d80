// SPDX-License-Identifier: BSD-3-Clause
// Verdicts on maps whose fate is known, or known from long simulation; certificates,
// true and tampered.
#include "contact_flow/piecewise_linear/stability.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "contact_flow/budget.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "src/piecewise_linear/common_quadratic_norm.h"
#include "test/analysis/random_conewise.h"
#include "test/budgets.h"

namespace contact_flow {
namespace {

/// A(t, D) = [[t, 1], [−D, 0]]: pieces on y₁ ≤ 0 and y₁ ≥ 0 that agree on y₁ = 0.
PiecewiseLinearMap Trap(double t_left, double D_left, double t_right, double D_right) {
  const Matrix normal = Eigen::RowVector2d(1, 0);
  Matrix left(2, 2), right(2, 2);
  left << t_left, 1, -D_left, 0;
  right << t_right, 1, -D_right, 0;
  return PiecewiseLinearMap({{left, -normal, {}, {}}, {right, normal, {}, {}}});
}

double SpectralRadius(const Matrix& A) { return A.eigenvalues().cwiseAbs().maxCoeff(); }

TEST(StabilityTraps, SchurPiecesButUnstable) {
  const PiecewiseLinearMap map = Trap(-1.8, 0.9, -0.5, 0.9);
  for (const LinearPiece& piece : map.pieces()) EXPECT_LT(SpectralRadius(piece.matrix), 1);
  const StabilityReport report = AssessStability(map);
  ASSERT_EQ(StabilityVerdict::kUnstable, report.verdict) << report.message;
  EXPECT_EQ(StabilityTest::kGrowingRay, report.certificate.test);
  // The word L, L, R or a rotation of it.
  std::vector<int> word = report.certificate.words.at(0);
  ASSERT_EQ(3u, word.size());
  EXPECT_EQ(1, word[0] + word[1] + word[2]);
  EXPECT_NEAR(1.62, report.certificate.bound, 0.005);
  EXPECT_TRUE(VerifyCertificate(map, report.certificate));
  Vector y = report.certificate.directions.col(0);
  for (int k = 0; k < 30; ++k) y = map(y);
  EXPECT_NEAR(std::pow(report.certificate.bound, 10), y.norm(), 1e-6 * y.norm());
}

TEST(StabilityTraps, UnstablePiecesButStable) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const PiecewiseLinearMap map = Trap(-0.7, 1.1, -1.7, 0.3);
  for (const LinearPiece& piece : map.pieces()) EXPECT_GT(SpectralRadius(piece.matrix), 1);
  const StabilityReport report = AssessStability(map);
  ASSERT_EQ(StabilityVerdict::kStable, report.verdict) << report.message;
  EXPECT_EQ(StabilityTest::kWords, report.certificate.test);
  EXPECT_TRUE(VerifyCertificate(map, report.certificate));
  EXPECT_LT(report.growth_above, 1);
  EXPECT_NEAR(0.6296, WorstGain(map, 8), 5e-5);
  // The same by brute force: the worst of many points on the unit square.
  double worst = 0;
  for (int k = 0; k < 4000; ++k) {
    Vector y(2);
    const double s = -1 + 2.0 * (k % 1000) / 1000;
    if (k / 1000 == 0) y << s, 1;
    if (k / 1000 == 1) y << s, -1;
    if (k / 1000 == 2) y << 1, s;
    if (k / 1000 == 3) y << -1, s;
    for (int step = 0; step < 8; ++step) y = map(y);
    worst = std::max(worst, y.cwiseAbs().maxCoeff());
  }
  EXPECT_NEAR(worst, WorstGain(map, 8), 1e-2);
  EXPECT_GE(WorstGain(map, 8), worst - 1e-9);
}

PiecewiseLinearMap OnTheLine(double slope_left, double slope_right) {
  const Matrix one = Matrix::Ones(1, 1);
  return PiecewiseLinearMap({{slope_left * one, -one, {}, {}}, {slope_right * one, one, {}, {}}});
}

TEST(Stability, OfTheLine) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  // x > 0 is thrown to −2x, from where it shrinks by 1/4.
  EXPECT_EQ(StabilityVerdict::kStable, AssessStability(OnTheLine(0.25, -2)).verdict);
  EXPECT_EQ(StabilityVerdict::kUnstable, AssessStability(OnTheLine(-0.6, -2)).verdict);
  EXPECT_EQ(StabilityVerdict::kStable, AssessStability(OnTheLine(-0.4, -2)).verdict);
  EXPECT_EQ(StabilityVerdict::kUnstable, AssessStability(OnTheLine(0.5, 1.1)).verdict);
  EXPECT_EQ(StabilityVerdict::kUndetermined, AssessStability(OnTheLine(0.5, 1)).verdict);
  EXPECT_EQ(StabilityVerdict::kUndetermined, AssessStability(OnTheLine(-0.5, -2)).verdict);
}

TEST(Stability, OfLinearMapsIsTheSpectralRadius) {
  std::mt19937 generator(3);
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 1 + trial % 6;
    Matrix A = test::RandomMatrix(n, n, &generator);
    const double radius = trial % 2 == 0 ? 0.97 : 1.03;
    A *= radius / SpectralRadius(A);
    const PiecewiseLinearMap map = PiecewiseLinearMap::Linear(A);
    const StabilityReport report = AssessStability(map);
    EXPECT_EQ(radius < 1 ? StabilityVerdict::kStable : StabilityVerdict::kUnstable, report.verdict)
        << report.message << "\n"
        << A;
    EXPECT_TRUE(VerifyCertificate(map, report.certificate));
  }
}

TEST(Stability, QuadraticNormReachesTheLargerOfTwoCommutingRates) {
  // Commuting normal matrices, seen in skew coordinates: the best rate is the largest
  // spectral radius.
  std::mt19937 generator(4);
  Matrix rotation(3, 3), T = test::RandomMatrix(3, 3, &generator);
  rotation << 0.8 * std::cos(1), -0.8 * std::sin(1), 0, 0.8 * std::sin(1), 0.8 * std::cos(1), 0, 0,
      0, 0.3;
  const Matrix A = T * rotation * T.inverse(), B = T * rotation * rotation * T.inverse();
  const CommonQuadraticNorm found = FindCommonQuadraticNorm({A, B});
  EXPECT_NEAR(0.8, found.rate, 1e-3);
  EXPECT_GE(found.rate, 0.8 - 1e-9);
  EXPECT_NEAR(found.rate, QuadraticRate({A, B}, found.P), 1e-9);
}

TEST(Stability, PiecesThatDoNotCoverAreNoMap) {
  const Matrix normal = Eigen::RowVector2d(1, 0);
  const PiecewiseLinearMap half({{0.5 * Matrix::Identity(2, 2), normal, {}, {}}});
  EXPECT_EQ(StabilityVerdict::kUndetermined, AssessStability(half).verdict);
  EXPECT_THROW(AssessStability(PiecewiseLinearMap::Linear(Matrix::Ones(2, 3))),
               std::invalid_argument);
}

TEST(Stability, BudgetsAndCancellingEndTheSearch) {
  const PiecewiseLinearMap map = Trap(-0.7, 1.1, -1.7, 0.3);
  StabilityOptions few;
  few.max_words = 3;
  EXPECT_EQ(StabilityVerdict::kUndetermined, AssessStability(map, few).verdict);
  StabilityOptions cancelled;
  cancelled.cancelled = [] { return true; };
  EXPECT_EQ(StabilityVerdict::kUndetermined, AssessStability(map, cancelled).verdict);
  StabilityOptions shallow;
  shallow.max_word_length = 2;
  const StabilityReport report = AssessStability(map, shallow);
  EXPECT_EQ(StabilityVerdict::kUndetermined, report.verdict);
  EXPECT_GE(report.growth_above, 1) << "a bound that was not proven";
}

/// Words of a hundred thousand pieces, each of whose beginnings is a word too: they are rejected
/// before they take time or room, and with it the process.
TEST(StabilityCertificates, OfEndlessWordsAreRejectedAtOnce) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const PiecewiseLinearMap stable = Trap(-0.7, 1.1, -1.7, 0.3);
  StabilityCertificate certificate = AssessStability(stable).certificate;
  ASSERT_EQ(StabilityTest::kWords, certificate.test);
  certificate.words.front().assign(100000, 0);
  const test::ThreadClock clock;
  const double begin = clock.Now();
  EXPECT_FALSE(VerifyCertificate(stable, certificate));
  // Many of the longest that may be: 2e6 pieces, of 120 bytes each.
  certificate.words.assign(2000, std::vector<int>(1000, 0));
  for (std::size_t k = 0; k < certificate.words.size(); ++k) {
    for (std::size_t i = 0; i < 11; ++i) certificate.words[k][i] = static_cast<int>(k >> i) & 1;
  }
  EXPECT_FALSE(VerifyCertificate(stable, certificate));
  {
    const BudgetScope scope{Budget({100, 100, {}})};
    EXPECT_THROW(VerifyCertificate(stable, certificate), BudgetExceeded);
  }
  // The lists of all beginnings would take 4 GB and minutes.
  EXPECT_LT(clock.Now() - begin, 30);
}

TEST(StabilityCertificates, TamperedOnesAreRejected) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const PiecewiseLinearMap stable = Trap(-0.7, 1.1, -1.7, 0.3);
  const PiecewiseLinearMap unstable = Trap(-1.8, 0.9, -0.5, 0.9);
  const StabilityCertificate words = AssessStability(stable).certificate;
  const StabilityCertificate ray = AssessStability(unstable).certificate;
  ASSERT_TRUE(VerifyCertificate(stable, words));
  ASSERT_TRUE(VerifyCertificate(unstable, ray));
  EXPECT_FALSE(VerifyCertificate(unstable, words));
  EXPECT_FALSE(VerifyCertificate(stable, ray));

  const auto rejects = [](const PiecewiseLinearMap& map, StabilityCertificate certificate,
                          const std::function<void(StabilityCertificate*)>& tamper) {
    tamper(&certificate);
    return !VerifyCertificate(map, certificate);
  };
  using C = StabilityCertificate;
  EXPECT_TRUE(rejects(stable, words, [](C* c) { c->words.pop_back(); }));
  EXPECT_TRUE(rejects(stable, words, [](C* c) { c->words.front().push_back(7); }));
  EXPECT_TRUE(rejects(stable, words, [](C* c) { c->words.front().pop_back(); }));
  EXPECT_TRUE(rejects(stable, words, [](C* c) { c->words.clear(); }));
  EXPECT_TRUE(rejects(stable, words, [](C* c) { c->bound = 0.1; }));
  EXPECT_TRUE(rejects(stable, words, [](C* c) { c->bound = 1.5; }));
  EXPECT_TRUE(rejects(stable, words, [](C* c) { c->bound = std::nan(""); }));
  EXPECT_TRUE(rejects(stable, words, [](C* c) { c->norm.row(0) = c->norm.row(1); }));
  EXPECT_TRUE(rejects(stable, words, [](C* c) { c->norm.resize(0, 0); }));
  EXPECT_TRUE(rejects(stable, words, [](C* c) { c->norm(0, 0) *= 1e5; }));
  EXPECT_TRUE(rejects(stable, words, [](C* c) { c->test = StabilityTest::kNormOne; }));
  EXPECT_TRUE(rejects(stable, words, [](C* c) { c->test = StabilityTest::kQuadraticNorm; }));
  EXPECT_TRUE(rejects(unstable, ray, [](C* c) { c->directions *= -1; }));
  EXPECT_TRUE(rejects(unstable, ray, [](C* c) { c->directions(0) += 1e-3; }));
  EXPECT_TRUE(rejects(unstable, ray, [](C* c) { c->directions.setZero(); }));
  EXPECT_TRUE(rejects(unstable, ray, [](C* c) { c->bound *= 1.001; }));
  EXPECT_TRUE(rejects(unstable, ray, [](C* c) { c->words[0][1] = 1 - c->words[0][1]; }));
  EXPECT_TRUE(rejects(unstable, ray, [](C* c) { c->words[0][0] = -1; }));
  EXPECT_TRUE(rejects(unstable, ray, [](C* c) { c->words[0].pop_back(); }));
  EXPECT_TRUE(rejects(unstable, ray, [](C* c) { c->test = StabilityTest::kGrowingPlane; }));
  EXPECT_TRUE(rejects(unstable, ray, [](C* c) { c->test = StabilityTest::kWords; }));
}

TEST(StabilityCertificates, OfNormsAndPlanes) {
  Matrix spiral(3, 3);
  spiral << 0, -1.1, 0, 1.1, 0, 0, 0, 0, 0.5;
  const Matrix normal = Eigen::RowVector3d(0, 0, 1);
  Matrix other = spiral;
  other(2, 2) = 0.2;
  const PiecewiseLinearMap map({{spiral, normal, {}, {}}, {other, -normal, {}, {}}});
  StabilityCertificate plane = AssessStability(map).certificate;
  ASSERT_EQ(StabilityTest::kGrowingPlane, plane.test);
  EXPECT_NEAR(1.1, plane.bound, 1e-9);
  EXPECT_TRUE(VerifyCertificate(map, plane));
  plane.directions(2, 0) += 1e-3;
  EXPECT_FALSE(VerifyCertificate(map, plane)) << "leaves the lineality space of the cones";

  Matrix sheared(2, 2);
  sheared << 0.9, 1, 0, 0.9;
  const PiecewiseLinearMap linear = PiecewiseLinearMap::Linear(sheared);
  StabilityCertificate quadratic = AssessStability(linear).certificate;
  ASSERT_EQ(StabilityTest::kQuadraticNorm, quadratic.test);
  EXPECT_TRUE(VerifyCertificate(linear, quadratic));
  for (int tampering = 0; tampering < 4; ++tampering) {
    StabilityCertificate bad = quadratic;
    if (tampering == 0) bad.norm = Matrix::Identity(2, 2);
    if (tampering == 1) bad.norm *= -1;
    if (tampering == 2) bad.norm(0, 1) += 0.01;
    if (tampering == 3) bad.bound = 0.5;
    EXPECT_FALSE(VerifyCertificate(linear, bad)) << tampering;
  }
  EXPECT_FALSE(VerifyCertificate(linear, {StabilityTest::kNormTwo, 0.99, {}, {}, {}}));
  EXPECT_TRUE(VerifyCertificate(PiecewiseLinearMap::Linear(0.5 * sheared),
                                {StabilityTest::kNormInfinity, 0.96, {}, {}, {}}));
}

/// A random continuous map of 2 to 6 dimensions and 2 to 24 cones, scaled so that its fate is open.
PiecewiseLinearMap RandomMap(std::mt19937* generator) {
  const int n = 2 + static_cast<int>((*generator)() % 5);
  const int most_folds[] = {0, 0, 12, 5, 4, 4, 4};  // 24, 22, 16, 16, 16 cells
  PiecewiseLinearMap map;
  if (n == 2 && (*generator)() % 2 == 0) {
    const int rays = 3 + static_cast<int>((*generator)() % 22);
    std::vector<double> angles(rays);
    std::uniform_real_distribution<double> jitter(0, 0.5);
    for (int k = 0; k < rays; ++k) angles[k] = 2 * M_PI * (k + jitter(*generator)) / rays;
    map = test::Fan(angles, test::RandomMatrix(2, rays, generator));
  } else {
    const int folds = 1 + static_cast<int>((*generator)() % most_folds[n]);
    map = test::SumOfFolds(test::RandomMatrix(n, n, generator),
                           test::RandomMatrix(n, folds, generator) / folds,
                           test::RandomMatrix(folds, n, generator));
  }
  // The largest growth that a few simulations meet becomes 0.7 … 1.2.
  double growth = 0;
  for (int start = 0; start < 8; ++start) {
    Vector y = test::RandomMatrix(n, 1, generator);
    double log_growth = 0;
    for (int k = 0; k < 100; ++k) {
      const double before = y.norm();
      y = map(y);
      log_growth += std::log(y.norm() / before);
      y.normalize();
    }
    growth = std::max(growth, std::exp(log_growth / 100));
  }
  const double target = std::uniform_real_distribution<double>(0.7, 1.2)(*generator);
  std::vector<LinearPiece> pieces = map.pieces();
  for (LinearPiece& piece : pieces) piece.matrix *= target / growth;
  return PiecewiseLinearMap(pieces);
}

/// log ‖f^steps(y)‖/‖y‖ per step.
double LogGrowth(const PiecewiseLinearMap& map, Vector y, int steps) {
  double sum = 0;
  for (int k = 0; k < steps; ++k) {
    const double before = y.norm();
    y = map(y);
    if (y.norm() == 0) return -std::numeric_limits<double>::infinity();
    sum += std::log(y.norm() / before);
    y.normalize();
  }
  return sum / steps;
}

TEST(StabilityOfRandomMaps, NeverContradictsSimulation) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  std::mt19937 generator(11);
  constexpr int kMaps = 250, kStarts = 20, kSteps = 400;
  int stable = 0, unstable = 0, undetermined = 0;
  StabilityOptions options;
  options.max_words = 500;
  options.max_linear_programs = 1500;
  options.consistency.checked = true;  // they are maps by construction (map_consistency_test)
  for (int trial = 0; trial < kMaps; ++trial) {
    const PiecewiseLinearMap map = RandomMap(&generator);
    const StabilityReport report = AssessStability(map, options);
    ASSERT_LE(report.growth_below, report.growth_above * (1 + 1e-6)) << trial;
    double largest = -std::numeric_limits<double>::infinity();
    for (int start = 0; start < kStarts; ++start) {
      largest =
          std::max(largest, LogGrowth(map, test::RandomMatrix(map.cols(), 1, &generator), kSteps));
    }
    // A start may grow by a constant c before its rate shows: log(c)/kSteps, c below 1e4 here.
    EXPECT_LE(largest, std::log(report.growth_above) + std::log(1e4) / kSteps) << trial;
    if (report.verdict == StabilityVerdict::kStable) {
      ++stable;
      EXPECT_LT(largest, 0) << trial << " " << report.message;
    } else if (report.verdict == StabilityVerdict::kUnstable) {
      ++unstable;
      // The direction grows as claimed; over few periods, for it need not attract.
      const int length = static_cast<int>(report.certificate.words[0].size());
      const double grown = LogGrowth(map, report.certificate.directions.col(0), 2 * length);
      if (report.certificate.test == StabilityTest::kGrowingRay) {
        EXPECT_NEAR(std::log(report.certificate.bound) / length, grown, 1e-5) << trial;
      }
      EXPECT_GT(report.certificate.bound, 1);
    } else {
      ++undetermined;
    }
    if (report.verdict != StabilityVerdict::kUndetermined) {
      EXPECT_TRUE(VerifyCertificate(map, report.certificate, options)) << trial;
    }
  }
  RecordProperty("stable", stable);
  RecordProperty("unstable", unstable);
  RecordProperty("undetermined", undetermined);
  std::printf("of %d maps %d stable, %d unstable, %d undetermined\n", kMaps, stable, unstable,
              undetermined);
  EXPECT_GT(stable, kMaps / 4);
  EXPECT_GT(unstable, kMaps / 10);
  EXPECT_LT(undetermined, 3 * kMaps / 10);
}

}  // namespace
}  // namespace contact_flow
