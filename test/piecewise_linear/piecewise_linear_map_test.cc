// SPDX-License-Identifier: BSD-3-Clause
// The laws of piecewise-linear maps, on random continuous ones.
#include "contact_flow/piecewise_linear/piecewise_linear_map.h"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

#include "src/piecewise_linear/cone_interior.h"

namespace contact_flow {
namespace {

/// A random continuous map of two pieces, A on n·w ≥ 0 and A + k nᵀ on n·w ≤ 0 (Council et al.).
PiecewiseLinearMap TwoRandomPieces(int rows, int cols, std::mt19937* generator, const char* name) {
  std::normal_distribution<double> normal;
  const auto random = [&](int r, int c) {
    Matrix m(r, c);
    for (int i = 0; i < m.size(); ++i) m(i) = normal(*generator);
    return m;
  };
  const Matrix A = random(rows, cols), k = random(rows, 1),
               n = random(1, cols).rowwise().normalized();
  LinearPiece above{A, n, {{std::string(name) + "+"}}, {}};
  LinearPiece below{A + k * n, -n, {{std::string(name) + "-"}}, {}};
  return PiecewiseLinearMap({above, below});
}

class RandomMaps : public testing::Test {
 protected:
  Vector RandomVector(int size) {
    std::normal_distribution<double> normal;
    Vector v(size);
    for (int i = 0; i < size; ++i) v(i) = normal(generator);
    return v;
  }
  std::mt19937 generator{9};
};

TEST_F(RandomMaps, CompositionIsTheMapOfMaps) {
  for (int trial = 0; trial < 30; ++trial) {
    const PiecewiseLinearMap f = TwoRandomPieces(4, 3, &generator, "f"),
                             g = TwoRandomPieces(2, 4, &generator, "g"),
                             h = TwoRandomPieces(5, 2, &generator, "h");
    const PiecewiseLinearMap left = h.After(g).After(f), right = h.After(g.After(f));
    for (int k = 0; k < 50; ++k) {
      const Vector w = RandomVector(3);
      const Vector value = h(g(f(w)));
      EXPECT_LE((left(w) - value).norm(), 1e-10 * (1 + value.norm()));
      EXPECT_LE((right(w) - value).norm(), 1e-10 * (1 + value.norm()));
      EXPECT_LE((left(3 * w) - 3 * value).norm(), 1e-10 * (1 + value.norm()));
    }
  }
}

TEST_F(RandomMaps, WordsWithoutInteriorAreDropped) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  // The same half-spaces twice: of four words only two have interior.
  const Matrix n = Eigen::RowVector2d(1, 0);
  const LinearPiece right{Matrix::Identity(2, 2), n, {}, {}},
      left{Matrix::Identity(2, 2), -n, {}, {}};
  const PiecewiseLinearMap fold({right, left});
  EXPECT_EQ(2u, fold.After(fold).pieces().size());
}

TEST_F(RandomMaps, LabelsAreConcatenated) {
  const PiecewiseLinearMap f = TwoRandomPieces(2, 2, &generator, "f"),
                           g = TwoRandomPieces(2, 2, &generator, "g");
  const PiecewiseLinearMap words = g.After(f);
  for (const LinearPiece& piece : words.pieces()) {
    ASSERT_EQ(2u, piece.omega.size());
    EXPECT_EQ('f', piece.omega[0][0][0]);
    EXPECT_EQ('g', piece.omega[1][0][0]);
  }
}

TEST_F(RandomMaps, TooManyPiecesAreRefused) {
  const PiecewiseLinearMap f = TwoRandomPieces(3, 3, &generator, "f");
  EXPECT_THROW(f.After(f, 1), std::length_error);
  EXPECT_THROW(f.After(TwoRandomPieces(2, 3, &generator, "g")), std::invalid_argument);
  EXPECT_THROW(PiecewiseLinearMap(std::vector<LinearPiece>{}), std::invalid_argument);
}

TEST_F(RandomMaps, KinkVanishesExactlyForLinearMaps) {
  const Matrix A = Matrix::Random(3, 3);
  const PiecewiseLinearMap linear = PiecewiseLinearMap::Linear(A);
  EXPECT_EQ(0, linear.Kink());
  EXPECT_TRUE(linear.IsLinear());
  EXPECT_GT(TwoRandomPieces(3, 3, &generator, "f").Kink(), 0);
}

TEST(ConeInterior, IsDecidedByALinearProgram) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  Matrix wedge(2, 2), thin(2, 2), line(2, 2);
  wedge << 1, 0, 0, 1;
  const double angle = 1e-6;
  thin << 0, 1, std::sin(angle), -std::cos(angle);
  line << 0, 1, 0, -1;
  EXPECT_TRUE(HasInterior(wedge));
  EXPECT_TRUE(HasInterior(thin)) << "thin cones are kept";
  EXPECT_FALSE(HasInterior(line));
  EXPECT_TRUE(HasInterior(Matrix(0, 2)));
}

}  // namespace
}  // namespace contact_flow
