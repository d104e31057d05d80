// SPDX-License-Identifier: BSD-3-Clause
// A touchdown at T is a kink of the positions there, and a jump of the velocities: the driven ball
// against closed forms.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "contact_flow/model/model_library.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "test/trajectory_optimization/driven_ball.h"

namespace contact_flow {
namespace {

/// From 1 m at rest to −0.5 m, which no ball reaches, after 0.5 s, with two inputs.
class BallToTheFloor : public testing::Test {
 protected:
  BallToTheFloor() : system(MakeModel("driven_ball")) {
    problem.x = Eigen::Vector2d(1, 0);
    problem.inputs.grid = {0, 0.2};
    problem.duration = 0.5;
    problem.effort = Vector::Constant(1, 0.01);
    problem.weight = Eigen::Vector2d(10, 0);
    problem.target = Eigen::Vector2d(-0.5, 0);
    Begin(0);
  }
  void Begin(double u) { problem.inputs.values.assign(2, Vector::Constant(1, u)); }

  /// 0.01 Σ h u² with z(0.5) = 0 is least, and 10 · 0.5² beside it: by least squares of one row.
  static double Best() {
    const double row[] = {0.2 * 0.2 / 2 + 0.2 * 0.3, 0.3 * 0.3 / 2}, lengths[] = {0.2, 0.3};
    double reach = 0;
    for (int k = 0; k < 2; ++k) reach += row[k] * row[k] / (0.01 * lengths[k]);
    const double missing = test::kBallGravity * 0.5 * 0.5 / 2 - 1;
    return 10 * 0.25 + missing * missing / reach;
  }

  std::unique_ptr<MechanicalSystem> system;
  TrajectoryProblem problem;
};

TEST_F(BallToTheFloor, IsAValleyAtTheEnd) {
  for (double start : {-5.0, 0.0, 10.0}) {
    Begin(start);
    const TrajectoryOptimum found = OptimizeTrajectory(*system, problem);
    ASSERT_EQ(TrajectoryVerdict::kValley, found.verdict) << found.message;
    EXPECT_NEAR(Best(), found.cost, 1e-9);
    EXPECT_LT(found.hull_distance, 1e-6);
    ASSERT_EQ(2u, found.certificate.size());
    for (const PieceProof& piece : found.certificate) {
      ASSERT_EQ(1u, piece.slopes.size());
      EXPECT_TRUE(piece.slopes[0].first == "the end" || piece.slopes[0].second == "the end");
      EXPECT_GT(piece.slopes[0].slope, 1);
    }
  }
}

TEST_F(BallToTheFloor, IsACondition) {
  problem.weight.setZero();
  problem.conditions.push_back({TrajectoryCondition::Kind::kState, 0, 2, 0, 0});
  for (double start : {-5.0, 5.0}) {
    Begin(start);
    const TrajectoryOptimum found = OptimizeTrajectory(*system, problem);
    ASSERT_EQ(TrajectoryVerdict::kValley, found.verdict) << found.message;
    EXPECT_NEAR(Best() - 2.5, found.cost, 1e-9);
  }
}

TEST_F(BallToTheFloor, IsRefusedWhereTheVelocityThereCosts) {
  problem.weight(1) = 1;
  Begin(test::kBallGravity - 8);
  const TrajectoryOptimum found = OptimizeTrajectory(*system, problem);
  EXPECT_EQ(TrajectoryVerdict::kUndefined, found.verdict);
  const char* what = "the cost of d/dt z at the end is not continuous";
  EXPECT_NE(std::string::npos, found.message.find(what)) << found.message;
}

}  // namespace
}  // namespace contact_flow
