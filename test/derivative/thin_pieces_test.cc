// SPDX-License-Identifier: BSD-3-Clause
// Pieces on cones with hardly any interior, or none.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "contact_flow/piecewise_linear/linear_program.h"
#include "contact_flow/piecewise_linear/map_consistency.h"
#include "test/analysis/random_conewise.h"
#include "test/derivative/map_defect.h"

namespace contact_flow {
namespace {

using test::ExpectDefect;
using test::RandomMatrix;

class ThinPieces : public testing::Test {
 protected:
  void SetUp() override {
    if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  }
  std::mt19937 generator{13};
};

TEST_F(ThinPieces, ThinSectorsAreMapsToo) {
  for (double width : {1e-3, 1e-5, 1e-6}) {
    std::vector<double> angles;
    for (int k = 0; k < 6; ++k) {
      angles.push_back(k);
      angles.push_back(k + width);
    }
    // Values that differ by the width: slopes of order one everywhere.
    Matrix images = RandomMatrix(2, 12, &generator);
    for (int k = 0; k < 12; k += 2) {
      images.col(k + 1) = images.col(k) + width * RandomMatrix(2, 1, &generator);
    }
    const PiecewiseLinearMap map = test::Fan(angles, images);
    const MapConsistency found = CheckConsistency(map);
    EXPECT_TRUE(found.ok()) << width << " " << found.message;
    std::vector<LinearPiece> pieces = map.pieces();
    pieces.erase(pieces.begin() + 4);  // a thin one
    ExpectDefect(MapDefect::kGap, PiecewiseLinearMap(pieces), "a thin gap");
    pieces = map.pieces();
    pieces[4].matrix += 0.1 * RandomMatrix(2, 2, &generator);
    ExpectDefect(MapDefect::kJump, PiecewiseLinearMap(pieces), "a thin piece");
  }
}

TEST_F(ThinPieces, SectorsThinnerThanTheToleranceFillNothing) {
  // One of 5e-8 between two half-planes, with the slope that joins their values.
  const double width = 5e-8;
  Matrix left(1, 2), right(1, 2), between(2, 2);
  left << -1, 0;
  right << std::cos(width), -std::sin(width);
  between << -left, -right;
  Matrix A = Matrix::Identity(2, 2), B = A, C = A;
  C.row(0) += 1e-8 / width * Eigen::RowVector2d(1, 0);
  B.row(0) += Eigen::RowVector2d(0, 1e-8);
  const std::vector<LinearPiece> pieces = {
      {A, left, {}, {}}, {B, right, {}, {}}, {C, between, {}, {}}};
  const MapConsistency found = CheckConsistency(PiecewiseLinearMap(pieces));
  EXPECT_TRUE(found.ok()) << found.message;
  ExpectDefect(MapDefect::kGap, PiecewiseLinearMap(std::vector<LinearPiece>{pieces[2]}), "alone");
  ExpectDefect(MapDefect::kGap, PiecewiseLinearMap({pieces[0], pieces[2]}), "with one side");
}

TEST_F(ThinPieces, PiecesWithoutInteriorMustAgree) {
  const Matrix normal = Eigen::RowVector2d(1, 0);
  Matrix line(2, 2), point(4, 2);
  line << 1, 0, -1, 0;
  point << 1, 0, -1, 0, 0, 1, 0, -1;
  const Matrix A = Matrix::Identity(2, 2);
  Matrix same = A;
  same(0, 0) = 7;  // w₁ = 0 on the line
  EXPECT_TRUE(
      CheckConsistency(PiecewiseLinearMap({{A, Matrix(0, 2), {}, {}}, {same, line, {}, {}}})).ok());
  EXPECT_TRUE(
      CheckConsistency(
          PiecewiseLinearMap({{9 * A, point, {}, {}}, {A, normal, {}, {}}, {A, -normal, {}, {}}}))
          .ok());
  ExpectDefect(
      MapDefect::kJump,
      PiecewiseLinearMap({{2 * A, line, {}, {}}, {A, normal, {}, {}}, {A, -normal, {}, {}}}),
      "another value on the line");
  ExpectDefect(MapDefect::kGap, PiecewiseLinearMap(std::vector<LinearPiece>{{A, line, {}, {}}}),
               "a line alone");
}

}  // namespace
}  // namespace contact_flow
