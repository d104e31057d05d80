// SPDX-License-Identifier: BSD-3-Clause
// More contacts that depend on each other than words are tried of: a solution that springs found on
// the border of a cone may not be the only one there, and has no derivative.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <sstream>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/friction_problem.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kGravity;

constexpr double kPlateFriction = 0.4;
constexpr double kPoints[6][2] = {{0.3, 0},     {0.1, 0.2}, {-0.2, 0.2},
                                  {-0.3, -0.1}, {0, -0.2},  {0.2, -0.1}};

/// A plate of unit mass and inertia with its centre in the plane of its points, pressed on the
/// floor by its weight and pushed along x.
FrictionProblem Plate(double push) {
  const int size = 18;
  Matrix A = Matrix::Zero(size, 6);
  FrictionProblem problem;
  for (int i = 0; i < 6; ++i) {
    const double x = kPoints[i][0], y = kPoints[i][1];
    A.row(3 * i) << 0, 0, 1, y, -x, 0;
    A.row(3 * i + 1) << 1, 0, 0, 0, 0, -y;
    A.row(3 * i + 2) << 0, 1, 0, 0, 0, x;
    FrictionContact contact;
    contact.coefficient = kPlateFriction;
    contact.dimension = 2;
    problem.contacts.push_back(contact);
  }
  Vector free = Vector::Zero(6);
  free(0) = push;
  free(2) = -kGravity;
  problem.G = A * A.transpose();
  problem.b = A * free;
  return problem;
}

/// It sticks with room, slides with room, and in between stands on the border: one motion each.
TEST(BorderSprings, OnlyTheBorderCountsAsDecidedByThem) {
  for (const double part : {0.3, 0.9, 1.0}) {
    const std::vector<FrictionSolution> all =
        SolveFriction(Plate(part * kPlateFriction * kGravity));
    ASSERT_EQ(1u, all.size()) << part;
    EXPECT_LT(all[0].result.norm(), 1e-8 * kGravity) << part;
    EXPECT_EQ(part == 1, all[0].springs) << part;
  }
}

/// A body with these points that lands flat on them at the speed √(2 g h).
std::unique_ptr<RobotSystem> Lander() {
  RobotTexts texts;
  texts.urdf =
      "<robot name=\"plate\"><link name=\"plate\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" "
      "ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link></robot>";
  std::ostringstream yaml;
  yaml << "base: floating\nconstraints:\n";
  for (int i = 0; i < 6; ++i) {
    yaml << "  p" << i << ": {kind: plane, link: plate, point: [" << kPoints[i][0] << ", "
         << kPoints[i][1] << ", 0], friction: " << kPlateFriction << "}\n";
  }
  texts.yaml = yaml.str();
  return MakeRobot(texts);
}

/// The impulse that stops it is on the border where it slides at μ √(2 g h).
TEST(BorderSprings, ALandingOnTheBorderHasNoDerivative) {
  const auto plate = Lander();
  const double height = 0.05, down = std::sqrt(2 * kGravity * height);
  Vector x = plate->nominal().x;
  x(2) = height;
  x(plate->num_positions()) = kPlateFriction * down;
  const double lands = down / kGravity;
  const Trajectory run = Simulate(*plate, x, plate->nominal().u, lands + 0.1);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_FALSE(run.transitions.empty());
  EXPECT_NEAR(lands, run.transitions[0].t, 1e-9);
  EXPECT_LT(run.FinalState().tail(6).norm(), 1e-7);
  EXPECT_EQ(Outcome::kIndeterminateForces, run.transitions[0].obstacle.outcome);
  EXPECT_EQ(Outcome::kIndeterminateForces, DifferentiateOutcome(*plate, run).status.outcome);
}

}  // namespace
}  // namespace contact_flow
