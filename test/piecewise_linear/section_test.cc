// SPDX-License-Identifier: BSD-3-Clause
// The algebra of sections on random maps: nothing along ds, neutral directions,
// invariant subspaces.
#include "contact_flow/piecewise_linear/section.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <random>

#include "test/analysis/random_conewise.h"

namespace contact_flow {
namespace {

class Sections : public testing::Test {
 protected:
  Matrix Random(int rows, int cols) { return test::RandomMatrix(rows, cols, &generator); }
  PiecewiseLinearMap RandomMap(int rows, int cols) {
    return test::SumOfFolds(Random(rows, cols), Random(rows, 2), Random(2, cols));
  }
  std::mt19937 generator{21};
};

TEST_F(Sections, NullSpaceIsOrthonormalAndWhole) {
  Matrix rows(3, 5);
  rows.topRows(2) = Random(2, 5);
  rows.row(2) = rows.row(0) - 2 * rows.row(1);
  const Matrix basis = NullSpace(rows);
  ASSERT_EQ(3, basis.cols());
  EXPECT_LE((rows * basis).norm(), 1e-12);
  EXPECT_LE((basis.transpose() * basis - Matrix::Identity(3, 3)).norm(), 1e-12);
  EXPECT_EQ(4, NullSpace(Matrix(0, 4)).cols());
}

TEST_F(Sections, NearestBasisSpansTheSameAndComesNearest) {
  const Matrix basis = NullSpace(Random(2, 5)), other = NullSpace(Random(2, 5));
  const Matrix nearest = NearestBasis(basis, other);
  EXPECT_LE((nearest.transpose() * nearest - Matrix::Identity(3, 3)).norm(), 1e-12);
  EXPECT_LE((nearest - basis * (basis.transpose() * nearest)).norm(), 1e-12);
  for (int k = 0; k < 200; ++k) {
    const Matrix turn = Eigen::HouseholderQR<Matrix>(Random(3, 3)).householderQ();
    EXPECT_LE((nearest - other).norm(), (basis * turn - other).norm() + 1e-12);
  }
  EXPECT_LE((NearestBasis(basis * -1, basis) - basis).norm(), 1e-12);
  EXPECT_THROW(NearestBasis(basis, Random(5, 2)), std::invalid_argument);
}

TEST_F(Sections, OutcomesMoveAlongTheFieldOntoTheSection) {
  const PiecewiseLinearMap f = RandomMap(5, 4);
  const Vector ds = Random(5, 1), F = Random(5, 1);
  const PiecewiseLinearMap onto = OntoSection(f, ds, F), time = CrossingTime(f, ds, F);
  for (int k = 0; k < 50; ++k) {
    const Vector w = Random(4, 1);
    EXPECT_NEAR(0, ds.dot(onto(w)), 1e-11 * (1 + onto(w).norm()));
    EXPECT_LE((onto(w) - (f(w) + F * time(w)(0))).norm(), 1e-11 * (1 + f(w).norm()));
  }
  const Vector tangent = NullSpace(ds.transpose()).col(0);
  EXPECT_THROW(OntoSection(f, ds, Vector::Zero(5)), std::invalid_argument);
  EXPECT_THROW(OntoSection(f, tangent.head(3), F), std::invalid_argument);
}

TEST_F(Sections, InBasesIsTheMapSeenThroughThem) {
  const PiecewiseLinearMap f = RandomMap(5, 4);
  const Matrix end = NullSpace(Random(2, 5)), start = NullSpace(Random(1, 4));
  const PiecewiseLinearMap seen = InBases(f, end, start);
  for (int k = 0; k < 50; ++k) {
    const Vector z = Random(3, 1);
    EXPECT_LE((seen(z) - end.transpose() * f(start * z)).norm(), 1e-11);
  }
}

/// f(w) in coordinates (y, c): (g(y), h(y) + J c), turned by an orthogonal Q: c is neutral.
TEST_F(Sections, NeutralDirectionsAreSetAside) {
  const int n = 5, k = 2;
  const PiecewiseLinearMap g = RandomMap(n - k, n - k);
  Matrix J(k, k);
  J << 1, 0.8, 0, 1;
  const Matrix h = Random(k, n - k);
  const Matrix Q = Eigen::HouseholderQR<Matrix>(Random(n, n)).householderQ();
  std::vector<LinearPiece> pieces;
  for (const LinearPiece& piece : g.pieces()) {
    LinearPiece whole;
    Matrix A = Matrix::Zero(n, n), C = Matrix::Zero(piece.cone.rows(), n);
    A.topLeftCorner(n - k, n - k) = piece.matrix;
    A.bottomLeftCorner(k, n - k) = h;
    A.bottomRightCorner(k, k) = J;
    C.leftCols(n - k) = piece.cone;
    whole.matrix = Q * A * Q.transpose();
    whole.cone = C * Q.transpose();
    pieces.push_back(whole);
  }
  const PiecewiseLinearMap f(pieces);
  const ReducedMap reduced = SetAside(f, Q.rightCols(k) * Random(k, k));
  EXPECT_LE(reduced.residual, 1e-12);
  ASSERT_EQ(n - k, reduced.map.rows());
  for (int trial = 0; trial < 50; ++trial) {
    const Vector w = Random(n, 1);
    const Vector through = reduced.map(reduced.basis.transpose() * w);
    EXPECT_LE((through - reduced.basis.transpose() * f(w)).norm(), 1e-11 * (1 + f(w).norm()));
  }
  // Others are not neutral, and the residual says so.
  EXPECT_GT(SetAside(f, Q.leftCols(1)).residual, 1e-3);
  EXPECT_GT(SetAside(f, Random(n, 2)).residual, 1e-3);

  // The span of c is invariant, that of y is not.
  const ReducedMap inside = RestrictToInvariant(f, Q.rightCols(k));
  EXPECT_LE(inside.residual, 1e-12);
  EXPECT_GT(RestrictToInvariant(f, Q.leftCols(n - k)).residual, 1e-3);
  for (int trial = 0; trial < 20; ++trial) {
    const Vector z = Random(k, 1);
    EXPECT_LE((inside.basis * inside.map(z) - f(inside.basis * z)).norm(), 1e-11 * (1 + z.norm()));
  }
  EXPECT_THROW(SetAside(RandomMap(3, 4), Random(4, 1)), std::invalid_argument);
  EXPECT_THROW(SetAside(f, Random(n - 1, 1)), std::invalid_argument);
}

/// What is set aside is not asked about later: it must not grow, nor shrink, in any piece.
TEST_F(Sections, DirectionsThatGrowAreNotNeutral) {
  const auto residual = [](double position, double velocity) {
    Matrix A = Matrix::Zero(3, 3);
    A << position, 0.8, 0, 0, velocity, 0, 0, 0, 0.5;
    return SetAside(PiecewiseLinearMap::Linear(A), Matrix::Identity(3, 2)).residual;
  };
  EXPECT_LE(residual(1, 1), 1e-15);
  for (const double change : {1e-5, 1e-2, 0.5, -1e-5, -0.5}) {
    EXPECT_GE(residual(1, 1 + change), 0.6 * std::abs(change)) << change;
    EXPECT_GE(residual(1 + change, 1), 0.6 * std::abs(change)) << change;
  }
  EXPECT_GE(residual(std::exp(0.1), std::exp(-0.1)), 1e-3) << "as of a saddle";
  // J is that of all pieces.
  Matrix A = Matrix::Identity(3, 3), B = A, C(1, 3);
  A(0, 1) = 0.8;
  B(0, 1) = 0.3;
  C << 0, 0, 1;
  const PiecewiseLinearMap bent({{A, C, {}, {}}, {B, -C, {}, {}}});
  EXPECT_GE(SetAside(bent, Matrix::Identity(3, 2)).residual, 0.1);
}

}  // namespace
}  // namespace contact_flow
