// SPDX-License-Identifier: BSD-3-Clause
// Moments of piecewise-linear outcomes against 10⁵ samples, within their statistical error.
#include "contact_flow/piecewise_linear/covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/controllability.h"
#include "test/analysis/random_conewise.h"

namespace contact_flow {
namespace {

constexpr int kSamples = 100000;
constexpr double kSigmas = 5;  // of ~20 entries in ~60 maps none should lie further out

/// Compares with samples: each entry within kSigmas standard errors, the cubature's own included.
void ExpectSampled(const PiecewiseLinearMap& map, const Matrix& P, const OutcomeCovariance& result,
                   std::mt19937* generator) {
  const Eigen::Index r = map.rows();
  const Matrix root = P.llt().matrixL();
  Vector mean = Vector::Zero(r);
  Matrix moment = Matrix::Zero(r, r), fourth = Matrix::Zero(r, r);
  for (int k = 0; k < kSamples; ++k) {
    const Vector w = root * test::RandomMatrix(static_cast<int>(P.rows()), 1, generator);
    const Vector value = map(w);
    mean += value / kSamples;
    const Vector centred = value - result.mean;
    moment += centred * centred.transpose() / kSamples;
    fourth += (centred * centred.transpose()).cwiseAbs2() / kSamples;
  }
  for (Eigen::Index i = 0; i < r; ++i) {
    EXPECT_NEAR(mean(i), result.mean(i),
                kSigmas * (std::sqrt(moment(i, i) / kSamples) + result.mean_error))
        << CovarianceMethodName(result.method);
    for (Eigen::Index j = 0; j < r; ++j) {
      const double spread = std::sqrt((fourth(i, j) - moment(i, j) * moment(i, j)) / kSamples);
      EXPECT_NEAR(moment(i, j), result.covariance(i, j),
                  kSigmas * (spread + result.covariance_error))
          << CovarianceMethodName(result.method);
    }
  }
}

Matrix RandomCovariance(int n, std::mt19937* generator) {
  const Matrix root = test::RandomMatrix(n, n, generator);
  return root * root.transpose();
}

TEST(Covariance, OfLinearMapsIsExact) {
  std::mt19937 generator(1);
  const Matrix A = test::RandomMatrix(3, 4, &generator), P = RandomCovariance(4, &generator);
  const OutcomeCovariance result = PropagateCovariance(PiecewiseLinearMap::Linear(A), P);
  EXPECT_EQ(CovarianceMethod::kLinear, result.method);
  EXPECT_LE((result.covariance - A * P * A.transpose()).norm(), 1e-12);
  EXPECT_EQ(0, result.mean.norm());
}

TEST(Covariance, OfTwoHalfSpacesIsExact) {
  std::mt19937 generator(2);
  for (int trial = 0; trial < 20; ++trial) {
    const int n = 1 + trial % 5;
    const PiecewiseLinearMap map =
        test::SumOfFolds(test::RandomMatrix(3, n, &generator), test::RandomMatrix(3, 1, &generator),
                         test::RandomMatrix(1, n, &generator));
    const Matrix P = RandomCovariance(n, &generator);
    const OutcomeCovariance result = PropagateCovariance(map, P);
    ASSERT_EQ(CovarianceMethod::kTruncation, result.method);
    EXPECT_EQ(0, result.mean_error + result.covariance_error);
    ExpectSampled(map, P, result, &generator);
  }
}

/// (|w₁|, |w₂|), correlated, with standard deviations far apart, as in other units.
TEST(Covariance, UnitsDoNotMatter) {
  std::vector<LinearPiece> pieces;
  for (double a : {1.0, -1.0}) {
    for (double b : {1.0, -1.0}) {
      const Matrix piece = Eigen::Vector2d(a, b).asDiagonal();
      pieces.push_back({piece, piece, {}});
    }
  }
  const PiecewiseLinearMap map(pieces);
  const double mean = std::sqrt(2 / std::acos(-1.0));
  Matrix unit(2, 2);
  unit << 1, 0.5, 0.5, 1;
  const OutcomeCovariance same = PropagateCovariance(map, unit);
  ASSERT_EQ(CovarianceMethod::kCubature, same.method);
  EXPECT_NEAR(mean, same.mean(1), 0.03);
  for (double small : {1e-3, 1e-7, 1e-9, 1e-30}) {
    const Eigen::DiagonalMatrix<double, 2> scale(1, small);
    const OutcomeCovariance result = PropagateCovariance(map, scale * unit * scale);
    EXPECT_NEAR(same.mean(1), result.mean(1) / small, 1e-9) << small;
    EXPECT_NEAR(same.covariance(1, 1), result.covariance(1, 1) / (small * small), 1e-9) << small;
  }
}

/// A row of 1e-13 with a kink beside one of size 1 without.
TEST(Covariance, SmallRowsHaveSmallKinks) {
  Matrix above(2, 2), below(2, 2), cone(1, 2);
  above << 1, 0, 1e-13, 0;
  below << 1, 0, -1e-13, 0;
  cone << 1, 0;
  const PiecewiseLinearMap map({{above, cone, {}}, {below, -cone, {}}});
  const OutcomeCovariance result = PropagateCovariance(map, Matrix::Identity(2, 2));
  EXPECT_EQ(CovarianceMethod::kTruncation, result.method);
  EXPECT_NEAR(1e-13 * std::sqrt(2 / std::acos(-1.0)), result.mean(1), 1e-25);
}

TEST(Covariance, OfTheAbsoluteValueIsTheHalfNormals) {
  // |w| for w ~ N(0, σ²): mean σ√(2/π), variance σ²(1 − 2/π).
  const PiecewiseLinearMap absolute =
      test::SumOfFolds(Matrix::Zero(1, 1), Matrix::Ones(1, 1), Matrix::Ones(1, 1));
  const OutcomeCovariance result = PropagateCovariance(absolute, Matrix::Constant(1, 1, 4));
  EXPECT_NEAR(2 * std::sqrt(2 / M_PI), result.mean(0), 1e-14);
  EXPECT_NEAR(4 * (1 - 2 / M_PI), result.covariance(0, 0), 1e-14);
}

TEST(Covariance, OfManyConesByCubature) {
  std::mt19937 generator(3);
  for (int trial = 0; trial < 20; ++trial) {
    const int n = 2 + trial % 5;
    const PiecewiseLinearMap map =
        test::SumOfFolds(test::RandomMatrix(3, n, &generator), test::RandomMatrix(3, 3, &generator),
                         test::RandomMatrix(3, n, &generator));
    const Matrix P = RandomCovariance(n, &generator);
    const OutcomeCovariance result = PropagateCovariance(map, P);
    ASSERT_EQ(CovarianceMethod::kCubature, result.method);
    EXPECT_EQ(2000 * n, result.points);
    EXPECT_LE(result.covariance_error, 0.05 * result.covariance.trace());
    ExpectSampled(map, P, result, &generator);
  }
}

TEST(Covariance, CubatureOfTheKnown) {
  // |w₁| + |w₂| of independent normals: twice the half-normals' moments. In the plane
  // the rule is even.
  const PiecewiseLinearMap sum =
      test::SumOfFolds(Matrix::Zero(1, 2), Matrix::Ones(1, 2), Matrix::Identity(2, 2));
  const OutcomeCovariance result = PropagateCovariance(sum, Matrix::Identity(2, 2));
  ASSERT_EQ(CovarianceMethod::kCubature, result.method);
  // The midpoint rule with 1000 points for a quarter turn errs by ~(π/2000)²/6.
  EXPECT_NEAR(2 * std::sqrt(2 / M_PI), result.mean(0), 1e-6);
  EXPECT_NEAR(2 * (1 - 2 / M_PI), result.covariance(0, 0), 1e-5);
}

TEST(Covariance, OfSimulatedOutcomes) {
  // The double pendulum that reaches both stops at once: 10⁵ runs from normally distributed states
  // beside the moments of its derivative, within sampling error and O(σ).
  const auto pendulum = MakeModel("double_pendulum");
  const NominalRun& nominal = pendulum->nominal();
  const Trajectory run = Simulate(*pendulum, nominal.x, nominal.u, nominal.duration);
  const BDerivative B = DifferentiateOutcome(*pendulum, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  constexpr double kSigma = 1e-4;
  constexpr int kRuns = 100000;
  std::mt19937 generator(5);
  std::normal_distribution<double> normal(0, kSigma);
  const OutcomeCovariance moments =
      PropagateCovariance(B.Pieces(), kSigma * kSigma * Matrix::Identity(4, 4));
  EXPECT_EQ(CovarianceMethod::kTruncation, moments.method);
  SimulateOptions options;
  options.dense = false;
  options.simultaneity_tolerance = 1e-9;
  Vector mean = Vector::Zero(4);
  Matrix square = Matrix::Zero(4, 4);
  for (int k = 0; k < kRuns; ++k) {
    Vector x = nominal.x;
    for (double& number : x) number += normal(generator);
    const Trajectory perturbed = Simulate(*pendulum, x, nominal.u, nominal.duration, options);
    ASSERT_TRUE(perturbed.status.ok()) << perturbed.status.message;
    const Vector change = (perturbed.FinalState() - run.FinalState()) / kSigma;
    mean += change / kRuns;
    square += change * change.transpose() / kRuns;
  }
  const Matrix covariance = square - mean * mean.transpose();
  // Five standard errors, and second derivatives of the order of a hundred.
  const double size = covariance.diagonal().maxCoeff();
  EXPECT_LE((mean - moments.mean / kSigma).cwiseAbs().maxCoeff(),
            5 * std::sqrt(size / kRuns) + 100 * kSigma);
  EXPECT_LE((covariance - moments.covariance / (kSigma * kSigma)).cwiseAbs().maxCoeff(),
            5 * size * std::sqrt(2.0 / kRuns) + 100 * kSigma * size);
  EXPECT_GT(moments.mean.norm(), 0.1 * kSigma) << "the kink shows";
}

TEST(Covariance, OfSingularDistributions) {
  // All the uncertainty along one line that the fold cuts: the cubature is then exact.
  std::mt19937 generator(4);
  const Matrix direction = test::RandomMatrix(3, 1, &generator);
  const PiecewiseLinearMap two =
      test::SumOfFolds(test::RandomMatrix(2, 3, &generator), test::RandomMatrix(2, 2, &generator),
                       test::RandomMatrix(2, 3, &generator));
  const OutcomeCovariance result = PropagateCovariance(two, direction * direction.transpose());
  const Vector forth = two(direction), back = two(-direction);
  const Vector mean = (forth + back) / std::sqrt(2 * M_PI);
  const Matrix covariance =
      0.5 * (forth * forth.transpose() + back * back.transpose()) - mean * mean.transpose();
  EXPECT_LE((result.mean - mean).norm(), 1e-12);
  EXPECT_LE((result.covariance - covariance).norm(), 1e-12);
  EXPECT_EQ(0, PropagateCovariance(two, Matrix::Zero(3, 3)).covariance.norm());
}

TEST(Covariance, RefusesWhatIsNone) {
  const PiecewiseLinearMap map = PiecewiseLinearMap::Linear(Matrix::Identity(2, 2));
  Matrix P(2, 2);
  P << 1, 2, 2, 1;
  EXPECT_THROW(PropagateCovariance(map, P), std::invalid_argument);
  P << 1, 0.5, 0, 1;
  EXPECT_THROW(PropagateCovariance(map, P), std::invalid_argument);
  EXPECT_THROW(PropagateCovariance(map, Matrix::Identity(3, 3)), std::invalid_argument);
  // Beside a variance of 1e6 what is amiss between two of 1e-6 is as wrong.
  const PiecewiseLinearMap of_three = PiecewiseLinearMap::Linear(Matrix::Identity(3, 3));
  Matrix Q = Eigen::Vector3d(1e6, 1e-6, 1e-6).asDiagonal();
  EXPECT_NO_THROW(PropagateCovariance(of_three, Q));
  Q(1, 2) = Q(2, 1) = 2e-6;
  EXPECT_THROW(PropagateCovariance(of_three, Q), std::invalid_argument);
  Q(1, 2) = 5e-7;
  Q(2, 1) = -5e-7;
  EXPECT_THROW(PropagateCovariance(of_three, Q), std::invalid_argument);
  // Of nothing there is none, and nothing is read behind the end.
  for (const Matrix& none : {Matrix(0, 3), Matrix(3, 0)}) {
    const PiecewiseLinearMap empty = PiecewiseLinearMap::Linear(none);
    const Matrix any = Matrix::Identity(none.cols(), none.cols());
    EXPECT_THROW(PropagateCovariance(empty, any), std::invalid_argument);
    EXPECT_THROW(AssessControllability(empty), std::invalid_argument);
  }
}

}  // namespace
}  // namespace contact_flow
