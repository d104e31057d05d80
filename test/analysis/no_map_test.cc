// SPDX-License-Identifier: BSD-3-Clause
// Pieces that are no map have neither stability nor controllability, whatever each
// would have alone.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "contact_flow/piecewise_linear/controllability.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "contact_flow/piecewise_linear/stability.h"
#include "test/analysis/random_conewise.h"

namespace contact_flow {
namespace {

TEST(NoMap, IsNeitherAssessedNorVerified) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const Matrix identity = Matrix::Identity(2, 2), normal = Eigen::RowVector2d(1, 0);
  const StabilityCertificate small = {StabilityTest::kNormTwo, 0.6, {}, {}, {}};
  StabilityCertificate ray = {StabilityTest::kGrowingRay, 2, {}, {{0}}, Eigen::Vector2d(1, 1)};
  const auto none = [&](const std::vector<LinearPiece>& pieces, MapDefect defect) {
    const PiecewiseLinearMap map(pieces);
    const StabilityReport report = AssessStability(map);
    EXPECT_EQ(StabilityVerdict::kUndetermined, report.verdict) << report.message;
    EXPECT_EQ(defect, report.consistency.defect) << report.message;
    EXPECT_NE(std::string::npos, report.message.find("so that this is not a map"));
    EXPECT_TRUE(std::isinf(report.growth_above));
    EXPECT_FALSE(VerifyCertificate(map, small));
    EXPECT_FALSE(VerifyCertificate(map, ray));
  };
  const Matrix half = 0.5 * identity, third = identity / 3, twice = 2 * identity;
  none({{half, normal, {}, {}}, {third, -normal, {}, {}}}, MapDefect::kJump);
  none({{twice, normal, {}, {}}, {third, -normal, {}, {}}}, MapDefect::kJump);
  none({{half, identity, {}, {}}}, MapDefect::kGap);
  none({{twice, identity, {}, {}}}, MapDefect::kGap);
  none({{half, normal, {}, {}}, {half, -normal, {}, {}}, {third, identity, {}, {}}},
       MapDefect::kOverlap);
  // The same pieces where they are a map.
  const PiecewiseLinearMap right({{half, normal, {}, {}}, {half, -normal, {}, {}}});
  EXPECT_EQ(StabilityVerdict::kStable, AssessStability(right).verdict);
  EXPECT_TRUE(VerifyCertificate(right, small));
  EXPECT_TRUE(VerifyCertificate(PiecewiseLinearMap::Linear(twice), ray));
}

TEST(NoMap, OneThatCouldNotBeCheckedIsBelievedOnlyIfAsked) {
  std::mt19937 generator(9);
  const PiecewiseLinearMap folds =
      test::SumOfFolds(0.1 * test::RandomMatrix(3, 3, &generator),
                       0.01 * test::RandomMatrix(3, 3, &generator), Matrix::Identity(3, 3));
  StabilityOptions few;
  few.consistency.max_linear_programs = 1;
  EXPECT_EQ(StabilityVerdict::kUndetermined, AssessStability(folds, few).verdict);
  const StabilityCertificate small = {StabilityTest::kNormTwo, 0.9, {}, {}, {}};
  EXPECT_FALSE(VerifyCertificate(folds, small, few));
  few.consistency.believe_undecided = true;
  const StabilityReport report = AssessStability(folds, few);
  EXPECT_EQ(StabilityVerdict::kStable, report.verdict) << report.message;
  EXPECT_EQ(MapDefect::kUndecided, report.consistency.defect);
  EXPECT_TRUE(VerifyCertificate(folds, small, few));
}

TEST(NoMap, ReachesNothing) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const Matrix identity = Matrix::Identity(2, 2), normal = Eigen::RowVector2d(1, 0);
  const std::vector<std::vector<LinearPiece>> none = {
      {{identity, identity, {}, {}}},
      {{identity, normal, {}, {}}, {2 * identity, -normal, {}, {}}},
      {{identity, normal, {}, {}}, {identity, -normal, {}, {}}, {-identity, identity, {}, {}}}};
  for (const std::vector<LinearPiece>& pieces : none) {
    const ControllabilityReport report = AssessControllability(PiecewiseLinearMap(pieces));
    EXPECT_EQ(ControllabilityVerdict::kUndetermined, report.verdict) << report.message;
    EXPECT_FALSE(report.consistency.usable);
    EXPECT_FALSE(report.homeomorphism);
    EXPECT_NE(std::string::npos, report.message.find("so that this is not a map"));
  }
}

}  // namespace
}  // namespace contact_flow
