// SPDX-License-Identifier: BSD-3-Clause
// Right maps, by their construction, are never refused; damaged ones always, with a witness that is
// checked by the cones and matrices alone.
#include "contact_flow/piecewise_linear/map_consistency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "contact_flow/piecewise_linear/linear_program.h"
#include "test/analysis/random_conewise.h"
#include "test/derivative/map_defect.h"

namespace contact_flow {
namespace {

using test::ExpectDefect;
using test::ExpectWitness;
using test::RandomMatrix;
using test::RandomRightMap;

PiecewiseLinearMap Folds(int n, int folds, std::mt19937* generator) {
  return test::SumOfFolds(RandomMatrix(n, n, generator), RandomMatrix(n, folds, generator),
                          RandomMatrix(folds, n, generator));
}

class MapConsistencyTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  }
  std::mt19937 generator{12};
};

TEST_F(MapConsistencyTest, RightMapsAreNeverRefused) {
  std::size_t most_pieces = 0;
  long most_programs = 0;
  for (int trial = 0; trial < 150; ++trial) {
    const PiecewiseLinearMap map = RandomRightMap(&generator);
    const MapConsistency found = CheckConsistency(map);
    EXPECT_EQ(MapDefect::kNone, found.defect)
        << trial << ": " << map.pieces().size() << " pieces in " << map.cols()
        << " dimensions: " << found.message;
    EXPECT_TRUE(found.usable);
    most_pieces = std::max(most_pieces, map.pieces().size());
    most_programs = std::max(most_programs, found.linear_programs);
  }
  EXPECT_GE(most_pieces, 60u);
  std::printf("up to %zu pieces, %ld linear programs\n", most_pieces, most_programs);
}

TEST_F(MapConsistencyTest, UnitsOfRowsAndLengthsOfNormalsDoNotMatter) {
  for (int trial = 0; trial < 60; ++trial) {
    const PiecewiseLinearMap right = Folds(2 + trial % 5, 1 + trial % 3, &generator);
    Vector units(right.rows());
    std::uniform_real_distribution<double> exponent(-4, 4);
    for (int r = 0; r < right.rows(); ++r) units(r) = std::pow(10, exponent(generator));
    std::vector<LinearPiece> pieces = right.pieces();
    for (LinearPiece& piece : pieces) {
      piece.matrix = units.asDiagonal() * piece.matrix;
      for (Eigen::Index r = 0; r < piece.cone.rows(); ++r) {
        piece.cone.row(r) *= std::pow(10, exponent(generator));
      }
    }
    const MapConsistency found = CheckConsistency(PiecewiseLinearMap(pieces));
    EXPECT_TRUE(found.ok()) << found.message;
    // A jump of 1e-3 of the smallest row is found beside rows up to 1e8 times as large: at least
    // 1e-11 of them, where 1e-12 counts as rounding.
    Eigen::Index smallest;
    units.minCoeff(&smallest);
    pieces[0].matrix.row(smallest) +=
        1e-3 * units(smallest) * RandomMatrix(1, right.cols(), &generator);
    ExpectDefect(MapDefect::kJump, PiecewiseLinearMap(pieces), "the smallest row jumps");
  }
}

TEST_F(MapConsistencyTest, ARowThatVanishesButForRoundingErrorsDoesNotJump) {
  const Matrix normal = Eigen::RowVector2d(1, 0);
  Matrix A = Matrix::Identity(2, 2), B = A;
  A.row(1) << 1e-16, -3e-17;
  B.row(1) << -1e-16, 8e-17;
  const PiecewiseLinearMap map({{A, normal, {}, {}}, {B, -normal, {}, {}}});
  EXPECT_TRUE(CheckConsistency(map).ok());
  MapConsistencyOptions strict;
  strict.rounding = 0;
  EXPECT_EQ(MapDefect::kJump, CheckConsistency(map, strict).defect);
}

TEST_F(MapConsistencyTest, DamagedMapsAreAlwaysRefused) {
  int gaps = 0, overlaps = 0, jumps = 0;
  for (int trial = 0; trial < 200; ++trial) {
    PiecewiseLinearMap right = RandomRightMap(&generator);
    if (right.cols() < 2 || right.IsLinear()) continue;
    std::vector<LinearPiece> pieces = right.pieces();
    LinearPiece& one = pieces[generator() % pieces.size()];
    const Eigen::Index row =
        static_cast<Eigen::Index>(generator() % static_cast<unsigned>(one.cone.rows()));
    const double size = std::pow(10, -static_cast<int>(generator() % 4));  // 1 … 1e-3
    switch (trial % 5) {
      case 0: {  // a piece is lost
        if (InteriorRadius(one.cone) < 1e-5) continue;
        std::swap(one, pieces.back());
        pieces.pop_back();
        ExpectDefect(MapDefect::kGap, PiecewiseLinearMap(pieces), "lost");
        ++gaps;
        break;
      }
      case 1: {  // … or a part of it
        Matrix cut(one.cone.rows() + 1, one.cone.cols());
        cut << one.cone, RandomMatrix(1, right.cols(), &generator).normalized();
        Matrix rest = cut;
        rest.bottomRows(1) *= -1;
        if (InteriorRadius(rest) < 1e-5) continue;
        one.cone = cut;
        ExpectDefect(MapDefect::kGap, PiecewiseLinearMap(pieces), "cut");
        ++gaps;
        break;
      }
      case 2: {  // a piece grows over its neighbours
        Matrix beyond = one.cone;
        beyond.row(row) *= -1;
        if (InteriorRadius(beyond) < 1e-4) continue;  // the row was redundant
        one.cone.row(row) = one.cone.row((row + 1) % one.cone.rows()).eval();
        if (one.cone.rows() == 1) one.cone.resize(0, right.cols());
        ExpectDefect(MapDefect::kOverlap, PiecewiseLinearMap(pieces), "grown");
        ++overlaps;
        break;
      }
      case 3: {  // a matrix is off
        // Pieces of one facet may change by any multiple of its normal: a random change jumps.
        one.matrix += size * one.matrix.cwiseAbs().maxCoeff() *
                      RandomMatrix(right.rows(), right.cols(), &generator);
        ExpectDefect(MapDefect::kJump, PiecewiseLinearMap(pieces), "off");
        ++jumps;
        break;
      }
      default: {  // a face is tilted: a gap on one side of it, an overlap on the other, or both
        const Matrix before = one.cone;
        one.cone.row(row) += 0.1 * size * RandomMatrix(1, right.cols(), &generator);
        one.cone.row(row).normalize();
        Matrix lost = before;
        lost.conservativeResize(before.rows() + 1, Eigen::NoChange);
        lost.row(before.rows()) = -one.cone.row(row);
        Matrix won = one.cone;
        won.conservativeResize(before.rows() + 1, Eigen::NoChange);
        won.row(before.rows()) = -before.row(row);
        if (InteriorRadius(lost) < 1e-6 && InteriorRadius(won) < 1e-6) continue;
        const PiecewiseLinearMap tilted(pieces);
        const MapConsistency found = CheckConsistency(tilted);
        EXPECT_TRUE(found.defect == MapDefect::kGap || found.defect == MapDefect::kOverlap)
            << MapDefectName(found.defect) << " " << found.message;
        ExpectWitness(tilted, found);
      }
    }
  }
  EXPECT_GT(std::min({gaps, overlaps, jumps}), 20);
}

TEST_F(MapConsistencyTest, OneQuadrantIsNoMapAndFourAre) {
  const Matrix identity = Matrix::Identity(2, 2);
  std::vector<LinearPiece> quadrants;
  for (double a : {1.0, -1.0}) {
    for (double b : {1.0, -1.0}) {
      quadrants.push_back({identity, Vector(Eigen::Vector2d(a, b)).asDiagonal(), {}, {}});
    }
  }
  EXPECT_TRUE(CheckConsistency(PiecewiseLinearMap(quadrants)).ok());
  for (std::size_t count = 1; count < 4; ++count) {
    const std::vector<LinearPiece> some(quadrants.begin(),
                                        quadrants.begin() + static_cast<long>(count));
    ExpectDefect(MapDefect::kGap, PiecewiseLinearMap(some), "quadrants");
  }
}

TEST_F(MapConsistencyTest, GapsOverlapsAndJumpsBelowTheToleranceAreNone) {
  // Sectors of the plane; the last ends `angle` too early or too late, which is a ball of about
  // half that radius.
  const Matrix normal = Eigen::RowVector2d(1, 0);
  for (double angle : {1e-9, 1e-5, -1e-9, -1e-5}) {
    Matrix tilted(1, 2);
    tilted << -std::cos(angle), std::sin(angle);
    Matrix A = Matrix::Identity(2, 2), B = A;
    B(0, 0) = 3;  // agree on the face w₁ = 0
    const PiecewiseLinearMap map({{A, normal, {}, {}}, {B, tilted, {}, {}}});
    const MapConsistency found = CheckConsistency(map);
    EXPECT_EQ(std::abs(angle) < 1e-7, found.ok()) << angle << " " << found.message;
    if (!found.ok()) ExpectWitness(map, found);
  }
  for (double jump : {1e-9, 1e-5}) {
    Matrix A = Matrix::Identity(2, 2), B = A;
    B(1, 1) += jump;
    const PiecewiseLinearMap map({{A, normal, {}, {}}, {B, -normal, {}, {}}});
    EXPECT_EQ(jump < 1e-7, CheckConsistency(map).ok());
    MapConsistencyOptions wide;
    wide.tolerance = 1e-4;
    EXPECT_TRUE(CheckConsistency(map, wide).ok());
  }
}

TEST_F(MapConsistencyTest, OverlapsWithEqualMatricesAreHarmless) {
  for (int trial = 0; trial < 20; ++trial) {
    const int n = 2 + trial % 4;
    std::vector<LinearPiece> pieces = Folds(n, 2, &generator).pieces();
    // Each piece once more in two parts that overlap, and one of them a third time.
    const std::vector<LinearPiece> originals = pieces;
    for (const LinearPiece& piece : originals) {
      LinearPiece part = piece;
      part.cone.conservativeResize(piece.cone.rows() + 1, Eigen::NoChange);
      part.cone.bottomRows(1) = RandomMatrix(1, n, &generator).normalized();
      pieces.push_back(part);
    }
    pieces.push_back(originals[0]);
    const MapConsistency found = CheckConsistency(PiecewiseLinearMap(pieces));
    EXPECT_TRUE(found.ok()) << found.message;
    // Half-spaces that overlap cover what neither does alone.
    const Matrix A = RandomMatrix(n, n, &generator);
    Matrix rows = RandomMatrix(3, n, &generator);
    rows.row(2) = -rows.row(0) - rows.row(1);
    std::vector<LinearPiece> cover;
    for (int k = 0; k < 3; ++k) cover.push_back({A, rows.row(k), {}, {}});
    EXPECT_TRUE(CheckConsistency(PiecewiseLinearMap(cover)).ok());
    cover.pop_back();
    ExpectDefect(MapDefect::kGap, PiecewiseLinearMap(cover), "two half-spaces");
  }
}

TEST_F(MapConsistencyTest, WhatIsNotDecidedIsNotBelievedUnlessAsked) {
  const PiecewiseLinearMap map = Folds(6, 6, &generator);
  MapConsistencyOptions few;
  few.max_linear_programs = 50;
  MapConsistency found = CheckConsistency(map, few);
  EXPECT_EQ(MapDefect::kUndecided, found.defect);
  EXPECT_FALSE(found.usable);
  EXPECT_NE(std::string::npos, found.message.find("max_linear_programs = 50")) << found.message;
  EXPECT_LE(found.linear_programs, 50);
  few.believe_undecided = true;
  EXPECT_TRUE(CheckConsistency(map, few).usable);
  MapConsistencyOptions cancelled;
  cancelled.cancelled = [] { return true; };
  EXPECT_EQ(MapDefect::kUndecided, CheckConsistency(map, cancelled).defect);
  MapConsistencyOptions checked;
  checked.checked = true;
  EXPECT_TRUE(
      CheckConsistency(PiecewiseLinearMap(std::vector<LinearPiece>{map.pieces()[0]}), checked)
          .usable);
  std::vector<LinearPiece> pieces = map.pieces();
  pieces[0].matrix(0, 0) = std::nan("");
  EXPECT_THROW(CheckConsistency(PiecewiseLinearMap(pieces)), std::invalid_argument);
}

TEST(MapConsistency, FewPiecesNeedNoLinearPrograms) {
  const Matrix A = Matrix::Identity(2, 2), normal = Eigen::RowVector2d(1, 0);
  EXPECT_EQ(0, CheckConsistency(PiecewiseLinearMap::Linear(A)).linear_programs);
  const MapConsistency two =
      CheckConsistency(PiecewiseLinearMap({{A, normal, {}, {}}, {A, -normal, {}, {}}}));
  EXPECT_TRUE(two.ok());
  EXPECT_EQ(0, two.linear_programs);
}

}  // namespace
}  // namespace contact_flow
