// SPDX-License-Identifier: BSD-3-Clause
// Edges of a body: shares of springs on their cones, and slips in several directions.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <vector>

#include "contact_flow/dynamics/friction_problem.h"
#include "src/dynamics/turning_onset.h"

namespace contact_flow {
namespace {

constexpr double kMu = 0.8;

/// The points under a body of mass 2 with the moments of inertia 0.3, 0.5 and 0.4, by their places
/// from its centre: rows N = e_z and T = (e_x, e_y) of their velocities.
FrictionProblem UnderABody(const std::vector<Eigen::Vector3d>& places, Matrix* rows) {
  Vector inverse(6);
  inverse << 0.5, 0.5, 0.5, 1 / 0.3, 1 / 0.5, 1 / 0.4;
  FrictionProblem problem;
  rows->setZero(3 * static_cast<Eigen::Index>(places.size()), 6);
  for (std::size_t k = 0; k < places.size(); ++k) {
    FrictionContact contact;
    contact.coefficient = kMu;
    contact.dimension = 2;
    problem.contacts.push_back(contact);
    const Eigen::Vector3d axes[] = {Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX(),
                                    Eigen::Vector3d::UnitY()};
    for (int j = 0; j < 3; ++j) {
      const auto row = static_cast<Eigen::Index>(3 * k) + j;
      rows->row(row).head<3>() = axes[j].transpose();
      rows->row(row).tail<3>() = places[k].cross(axes[j]).transpose();
    }
  }
  problem.G = *rows * inverse.asDiagonal() * rows->transpose();
  return problem;
}

/// Six points, the body turning about the edge x = 1, whose corners carry 5 and 1 and together 2.4
/// along it. Springs share that equally, up to the cone of the lighter one. It is held: both stick.
TEST(EdgeShares, SpringsOnTheirConeStickWhereTheBodyHolds) {
  Matrix rows;
  FrictionProblem problem = UnderABody(
      {{1, 1, -0.5}, {1, -1, -0.5}, {0, 1, -0.5}, {0, -1, -0.5}, {-1, 1, -0.5}, {-1, -1, -0.5}},
      &rows);
  Vector force = Vector::Zero(18), turning(6);
  force.head<6>() << 5, 0, 1.6, 1, 0, 0.8;
  turning << 0.25, 0, 0.5, 0, 0.5, 0;  // about the edge: it stays
  const Vector result = rows * turning;
  ASSERT_LT(result.head<6>().cwiseAbs().maxCoeff(), 1e-12);
  ASSERT_GT(result(6), 0.1);
  problem.b = result - problem.G * force;
  const std::vector<FrictionSolution> all = SolveFriction(problem);
  ASSERT_EQ(1u, all.size());
  EXPECT_EQ(Letter::kStick, all.front().letters[0]);
  EXPECT_EQ(Letter::kStick, all.front().letters[1]);
  for (std::size_t k = 2; k < 6; ++k) EXPECT_EQ(Letter::kOpen, all.front().letters[k]);
  EXPECT_FALSE(all.front().springs);
  EXPECT_LT((all.front().result - result).cwiseAbs().maxCoeff(), 1e-9);
}

/// An edge along y whose ends have come to their cones together: it begins to turn about a point
/// between them, each end in its own direction.
TEST(EdgeShares, EndsBeginToSlipInTheirOwnDirections) {
  Matrix rows;
  const Eigen::Vector3d right(0, -0.3, -0.5), left(0, 0.3, -0.5);
  FrictionProblem problem = UnderABody({right, left}, &rows);
  // The edge turns at rate 1 about (0.02, 0.2): v = ω × r.
  const Eigen::Vector2d slow(-0.1, -0.02), fast(0.5, -0.02);
  Vector force(6);
  force << 5, -kMu * 5 * fast.normalized(), 1, -kMu * 1 * slow.normalized();
  problem.b = -problem.G * force;
  FrictionSolution stuck;
  stuck.letters = {Letter::kStick, Letter::kStick};
  stuck.directions.assign(2, Eigen::Vector2d::Zero());
  ASSERT_TRUE(SolveWord(problem, &stuck));
  const auto word = FindTurningOnset(problem, stuck, 1e-10);
  ASSERT_TRUE(word);
  EXPECT_TRUE(word->turns);
  EXPECT_EQ(Letter::kSlip, word->letters[0]);
  EXPECT_EQ(Letter::kSlip, word->letters[1]);
  EXPECT_LT((word->directions[0] - fast.normalized()).norm(), 1e-9);
  EXPECT_LT((word->directions[1] - slow.normalized()).norm(), 1e-9);
  const Vector speeds = OnsetSpeeds(problem, *word);
  EXPECT_EQ(1, speeds(0));
  EXPECT_NEAR(slow.norm() / fast.norm(), speeds(1), 1e-9);
  EXPECT_TRUE(SlipsMayBegin(problem, *word));
  FrictionSolution held = *word;  // the other end holds it along the edge
  held.letters[1] = Letter::kStick;
  EXPECT_FALSE(SlipsMayBegin(problem, held));
}

/// With a share left inside the cones nothing begins.
TEST(EdgeShares, SticksWhileSharesAreLeft) {
  Matrix rows;
  FrictionProblem problem = UnderABody({{0, -0.3, -0.5}, {0, 0.3, -0.5}}, &rows);
  Vector force(6);
  force << 5, -3.9, 0.1, 1, 0.3, 0.2;
  problem.b = -problem.G * force;
  for (const FrictionSolution& word : SolveFriction(problem)) {
    EXPECT_FALSE(word.turns);
    EXPECT_EQ(Letter::kStick, word.letters[0]);
    EXPECT_EQ(Letter::kStick, word.letters[1]);
  }
}

}  // namespace
}  // namespace contact_flow
