// SPDX-License-Identifier: BSD-3-Clause
// Analyses of maps end with their budget, wherever they are then; and what was divided into blocks
// for that gives what it gave.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <random>

#include "contact_flow/piecewise_linear/controllability.h"
#include "contact_flow/piecewise_linear/covariance.h"
#include "contact_flow/piecewise_linear/descent.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "contact_flow/piecewise_linear/newton.h"
#include "contact_flow/piecewise_linear/stability.h"
#include "random_conewise.h"
#include "src/piecewise_linear/common_quadratic_norm.h"
#include "test/budgets.h"

namespace contact_flow {
namespace {

using test::Ended;
using test::ExpectEndsInTime;
using test::RandomMatrix;
using test::RunWithin;

/// A continuous map of 64 pieces, 64 × 64, that neither contracts nor grows in plain sight.
PiecewiseLinearMap LargeMap() {
  std::mt19937 generator(3);
  const int n = 64;
  const Matrix Q = Eigen::HouseholderQR<Matrix>(RandomMatrix(n, n, &generator)).householderQ();
  return test::SumOfFolds(0.9 * Q, 0.02 * RandomMatrix(n, 6, &generator),
                          RandomMatrix(6, n, &generator));
}

TEST(Budget, EndsStability) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const PiecewiseLinearMap map = LargeMap();
  ASSERT_EQ(map.pieces().size(), 64u);
  ExpectEndsInTime([&] { AssessStability(map); }, {0.01, 0.3, 1, 3});
  StabilityOptions believed;
  believed.consistency.checked = true;
  ExpectEndsInTime([&] { AssessStability(map, believed); }, {0.01, 0.3, 1, 3});
}

TEST(Budget, EndsControllability) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const PiecewiseLinearMap map = LargeMap();
  ExpectEndsInTime([&] { AssessControllability(map); }, {0.01, 0.3});
  ControllabilityOptions believed;
  believed.consistency.checked = true;
  believed.max_candidates = 100000;
  // Fewer states than inputs: restrictions are tried.
  std::mt19937 generator(4);
  const PiecewiseLinearMap wide =
      test::SumOfFolds(RandomMatrix(40, 60, &generator), RandomMatrix(40, 6, &generator),
                       RandomMatrix(6, 60, &generator));
  ExpectEndsInTime([&] { AssessControllability(wide, believed); }, {0.01, 0.3, 1});
}

TEST(Budget, EndsCompositionAndCubature) {
  const PiecewiseLinearMap map = LargeMap();
  ExpectEndsInTime([&] { map.After(map).After(map, 1000000); }, {0.01, 0.3});
  CovarianceOptions many;
  many.rotations = 1000000;
  ExpectEndsInTime([&] { PropagateCovariance(map, Matrix::Identity(64, 64), many); }, {0.01, 0.3});
}

TEST(Budget, OfMemoryRefusesANormOfManyDimensions) {
  std::mt19937 generator(5);
  const int n = 160;  // 12880 entries of P: a Hessian of 1.3 GB, products of 2.6 GB
  std::vector<Matrix> matrices;
  for (int k = 0; k < 2; ++k) matrices.push_back(0.2 * RandomMatrix(n, n, &generator));
  const Ended ended =
      RunWithin(test::Megabytes(1000), [&] { FindCommonQuadraticNorm(matrices, 0.9); });
  EXPECT_EQ(ended.end, BudgetEnd::kMegabytes);
  EXPECT_NE(ended.message.find("160 dimensions"), std::string::npos) << ended.message;
}

TEST(Budget, OfMemoryRefusesWordsAndPieces) {
  const PiecewiseLinearMap map = LargeMap();
  const Ended pieces =
      RunWithin(test::Megabytes(10), [&] { map.After(map, 1000000); });  // 4096 of 37 kB
  EXPECT_EQ(pieces.end, BudgetEnd::kMegabytes);
  EXPECT_NE(pieces.message.find(" pieces"), std::string::npos) << pieces.message;
}

TEST(Budget, EndsSearchesWithTheBestSoFar) {
  // r = x², whose Newton iteration halves x each time, and J = Σ|x|.
  const NonsmoothEquation square = [](const Vector& x, bool) {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    EquationValue value;
    value.defined = value.has_map = true;
    value.residual = x.cwiseAbs2();
    value.map = PiecewiseLinearMap::Linear(Matrix(2 * x.asDiagonal()));
    return value;
  };
  NewtonOptions options;
  options.max_iterations = 1000;
  options.tolerance = 1e-300;
  NewtonResult found;
  const Ended ended = RunWithin(test::Seconds(0.3),
                                [&] { found = SolveEquation(square, Vector::Ones(2), options); });
  EXPECT_LT(ended.seconds, 0.3 + test::kPromise);
  EXPECT_EQ(found.status, NewtonStatus::kCancelled);
  EXPECT_NE(found.message.find("max_seconds = 0.3"), std::string::npos) << found.message;
  EXPECT_LT(found.x.cwiseAbs().maxCoeff(), 1) << "some iterations were made";
}

/// A_k = r T Q_k T⁻¹, Q_k orthogonal, contract by r in the norm of P = T⁻ᵀT⁻¹, and in general not
/// in the Euclidean one. Below and above the size at which blocks are used.
TEST(CommonQuadraticNormByBlocks, IsFoundWhereThereIsOne) {
  std::mt19937 generator(6);
  for (const int n : {12, 15, 16, 20, 24}) {
    Vector scales(n);
    for (int i = 0; i < n; ++i) scales(i) = i % 2 == 0 ? 1 : 4;
    std::vector<Matrix> matrices;
    for (int k = 0; k < 3; ++k) {
      const Matrix Q = Eigen::HouseholderQR<Matrix>(RandomMatrix(n, n, &generator)).householderQ();
      matrices.push_back(0.7 * scales.asDiagonal() * Q * scales.cwiseInverse().asDiagonal());
    }
    ASSERT_GT(QuadraticRate(matrices, Matrix::Identity(n, n)), 1);
    const CommonQuadraticNorm found = FindCommonQuadraticNorm(matrices, 0.8);
    // QuadraticRate looks at P and the matrices alone.
    EXPECT_LT(QuadraticRate(matrices, found.P), 0.8) << n;
  }
}

TEST(ReachableBasisByBlocks, SpansWhatAllColumnsSpan) {
  std::mt19937 generator(7);
  const int r = 8, m = 12, rank = 5, count = 400;  // 4800 columns
  const Matrix span = RandomMatrix(r, rank, &generator);
  std::vector<LinearPiece> pieces(count);
  Matrix all(r, m * count);
  for (int k = 0; k < count; ++k) {
    pieces[k].matrix = span * RandomMatrix(rank, m, &generator);
    pieces[k].cone = Matrix(0, m);
    all.middleCols(k * m, m) = pieces[k].matrix;
  }
  const Matrix basis = ReachableBasis(PiecewiseLinearMap(pieces));
  ASSERT_EQ(basis.cols(), rank);
  const Eigen::HouseholderQR<Matrix> factor(span);
  const Matrix exact = Matrix(factor.householderQ()).leftCols(rank);
  // Projectors on one space; rounding of sums of 4800 squares: √4800 · 1e-16, times
  // cond(span) < 1e3.
  EXPECT_LT((basis * basis.transpose() - exact * exact.transpose()).cwiseAbs().maxCoeff(), 1e-11);
}

}  // namespace
}  // namespace contact_flow
