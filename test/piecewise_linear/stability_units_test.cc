// SPDX-License-Identifier: BSD-3-Clause
// Verdicts on random maps whose states have units up to a million times apart: those of the same
// maps in units of one size.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "contact_flow/piecewise_linear/linear_program.h"
#include "contact_flow/piecewise_linear/stability.h"
#include "test/analysis/random_conewise.h"

namespace contact_flow {
namespace {

/// The map of x' = sizes ∘ x.
PiecewiseLinearMap InUnits(const PiecewiseLinearMap& map, const Vector& sizes) {
  const Vector inverse = sizes.cwiseInverse();
  std::vector<LinearPiece> pieces = map.pieces();
  for (LinearPiece& piece : pieces) {
    piece.matrix = (sizes.asDiagonal() * piece.matrix * inverse.asDiagonal()).eval();
    piece.cone = (piece.cone * inverse.asDiagonal()).eval();
    piece.cone.rowwise().normalize();
  }
  return PiecewiseLinearMap(pieces);
}

TEST(StabilityUnits, UnitsAMillionTimesApartChangeNoVerdict) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  std::mt19937 generator(11), units(5);
  std::uniform_real_distribution<double> decades(-3, 3);
  StabilityOptions options;
  options.max_words = 500;
  options.max_linear_programs = 5000;
  int decided = 0;
  for (int trial = 0; trial < 100; ++trial) {
    SCOPED_TRACE(trial);
    const int n = 2 + trial % 4, folds = 1 + trial % 3;
    const PiecewiseLinearMap map =
        test::SumOfFolds(0.35 * test::RandomMatrix(n, n, &generator),
                         0.35 / folds * test::RandomMatrix(n, folds, &generator),
                         test::RandomMatrix(folds, n, &generator));
    Vector sizes(n);
    for (Eigen::Index i = 0; i < n; ++i) sizes(i) = std::pow(10, decades(units));
    const PiecewiseLinearMap other = InUnits(map, sizes);
    const StabilityReport natural = AssessStability(map, options);
    const StabilityReport report = AssessStability(other, options);
    EXPECT_EQ(natural.verdict, report.verdict) << natural.message << "; " << report.message;
    if (report.verdict == StabilityVerdict::kUndetermined) continue;
    ++decided;
    EXPECT_TRUE(VerifyCertificate(other, report.certificate, options)) << report.message;
  }
  EXPECT_GE(decided, 60);
}

}  // namespace
}  // namespace contact_flow
