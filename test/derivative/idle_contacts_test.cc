// SPDX-License-Identifier: BSD-3-Clause
// Contacts that touch while nothing presses or lifts them: a ball of 1 kg whose weight a force just
// bears, after a plastic landing and after the force came to that. More force lifts it, less is
// taken by the floor: v(T) = max(0, u − m g) t by the force has two slopes.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

std::unique_ptr<MechanicalSystem> PlasticBall(double gravity) {
  return MakeModel("driven_ball", {{"gravity", gravity}, {"restitution", 0}});
}
BDerivative ByForce(const MechanicalSystem& ball, const Trajectory& run, bool inputs = true) {
  BDerivativeOptions options;
  options.variables.inputs = inputs;
  return DifferentiateOutcome(ball, run, options);
}
void ExpectUndecided(const Status& status) {
  EXPECT_EQ(Outcome::kNotDifferentiable, status.outcome) << status.message;
  EXPECT_NE(std::string::npos, status.message.find("neither pressed nor lifted")) << status.message;
}

TEST(IdleContacts, AfterALandingUnderJustTheWeight) {
  const auto ball = PlasticBall(10);
  for (const double off : {0.0, 1e-3, -1e-3}) {
    const Vector u = Vector::Constant(1, 10 + off);
    const Trajectory run = Simulate(*ball, Eigen::Vector2d(1, -1), u, 2);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    const BDerivative B = ByForce(*ball, run);
    if (off == 0) {
      ExpectUndecided(B.status);
      continue;
    }
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    EXPECT_NEAR(off > 0 ? 1 : 0, B(Vector::Unit(3, 2))(1), 1e-2) << off;
  }
  // By the state alone nothing lifts it: it ends on the floor wherever it lands.
  const Trajectory run = Simulate(*ball, Eigen::Vector2d(1, -1), Vector::Constant(1, 10), 2);
  const BDerivative B = ByForce(*ball, run, false);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_LE(B(Vector::Unit(2, 0)).norm() + B(Vector::Unit(2, 1)).norm(), 1e-9);
}

TEST(IdleContacts, AfterAChangeOfTheInputToJustTheWeight) {
  const auto ball = PlasticBall(10);
  InputSchedule inputs{{0, 1}, {Vector::Constant(1, 0), Vector::Constant(1, 10)}};
  RunCost cost;
  cost.terminal = [](const Vector& end, Vector* gradient) {
    *gradient = Vector::Unit(2, 1);
    return end(1);
  };
  BDerivativeOptions options;
  options.variables.inputs = true;
  for (const double last : {9.0, 10.0, 11.0}) {
    inputs.values[1](0) = last;
    const Trajectory run = Simulate(*ball, Vector::Zero(2), inputs, 2);
    const CostGradient slope = DifferentiateCost(*ball, run, cost, options);
    if (last == 10) {
      ExpectUndecided(slope.status);
      continue;
    }
    ASSERT_TRUE(slope.status.ok()) << slope.status.message;
    EXPECT_NEAR(last > 10 ? 1 : 0, slope.inputs(0, 1), 1e-9);
  }
}

/// Without gravity and force, too; a ball that bounces off it leaves.
TEST(IdleContacts, WithoutAnyForce) {
  const auto plastic = PlasticBall(0);
  const Trajectory lands = Simulate(*plastic, Eigen::Vector2d(1, -1), Vector::Zero(1), 2);
  ExpectUndecided(ByForce(*plastic, lands).status);
  EXPECT_TRUE(ByForce(*plastic, lands, false).status.ok());
  const auto elastic = MakeModel("driven_ball", {{"gravity", 0}, {"restitution", 1e-6}});
  const Trajectory leaves = Simulate(*elastic, Eigen::Vector2d(1, -1), Vector::Zero(1), 2);
  EXPECT_TRUE(ByForce(*elastic, leaves).status.ok()) << ByForce(*elastic, leaves).status.message;
}

/// What presses is rounding, as where a search has ended at no effort.
TEST(IdleContacts, UnderRoundingAlone) {
  const auto plastic = PlasticBall(0);
  for (const double u : {-4e-16, 0., -1e-6}) {
    const Trajectory lands = Simulate(*plastic, Eigen::Vector2d(1, -1), Vector::Constant(1, u), 2);
    if (u != -1e-6) {
      ExpectUndecided(ByForce(*plastic, lands).status);
    } else {
      EXPECT_TRUE(ByForce(*plastic, lands).status.ok()) << ByForce(*plastic, lands).status.message;
    }
  }
}

}  // namespace
}  // namespace contact_flow
