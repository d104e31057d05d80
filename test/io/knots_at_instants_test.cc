// SPDX-License-Identifier: BSD-3-Clause
// Knots of linear references right where a run begins or ends, or where its input changes, as grids
// have them: directions beside difference quotients, and what follows such a run.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/derivative/linearization.h"
#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/trajectory_optimization/policy.h"
#include "test/io/moving_robots.h"

namespace contact_flow {
namespace {

using test::Ball;
using test::Make;
using test::Tight;

/// 1 kg that follows a reference whose rate jumps at 0.2 s and 0.5 s, and at its end.
RobotSystem Follower(const std::string& more = "", double clock = 0) {
  return Make(Ball(),
              "{base: fixed, gravity: 0, efforts: {a: {kind: track, joint: z, "
              "feed_forward: u, stiffness: 40, damping: 4, " +
                  more +
                  "reference: {kind: linear, times: [0, 0.2, 0.5, 0.9], values: [0, 0.3, "
                  "-0.2, 0.1]}}}, nominal: {positions: {z: 0.1, clock: " +
                  std::to_string(clock) + "}, inputs: {u: 1}}}");
}

/// One input, or those of a grid.
struct Case {
  RobotSystem system;
  double duration;
  InputSchedule inputs;

  Trajectory Run(const Vector& moved) const {
    return Simulate(system, system.Perturb(system.nominal().x, moved), inputs, duration, Tight());
  }
  Vector Quotient(const Vector& w) const {
    const double alpha = 1e-6;
    return system.Separation(Run(alpha * w).FinalState(), Run(0 * w).FinalState()) / alpha;
  }
  BDerivative Differentiate() const {
    return DifferentiateOutcome(system, Run(Vector::Zero(4)), {});
  }
};

InputSchedule Grid(std::vector<double> times) {
  InputSchedule inputs;
  for (double t : times) inputs.values.push_back(Vector::Constant(1, 1 - t));
  inputs.grid = std::move(times);
  return inputs;
}

/// Tangents (z, clock, ż, its rate), the last of which no start changes.
void ExpectDirections(const Case& given, const BDerivative& B, std::vector<int> tangents) {
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (int j : tangents) {
    for (double sign : {1.0, -1.0}) {
      const Vector w = sign * Vector::Unit(4, j);
      EXPECT_LE((B(w) - given.Quotient(w)).cwiseAbs().maxCoeff(), 1e-4) << j << " " << sign;
    }
  }
}

TEST(KnotsAtInstants, WhereTheRunBegins) {
  const Case given{Follower("", 0.2), 0.1, Grid({0})};
  const BDerivative B = given.Differentiate();
  ExpectDirections(given, B, {0, 1, 2});
  ASSERT_TRUE(B.PiecewiseLinear().ok());
  const PiecewiseLinearMap pieces = B.Pieces();
  EXPECT_EQ(2u, pieces.pieces().size());
  for (double sign : {1.0, -1.0}) {
    const Vector w = Eigen::Vector4d(0.3, sign, -0.2, 0);
    EXPECT_LE((pieces(w) - B(w)).norm(), 1e-9) << sign;
  }
}

/// A ball on the floor, which the reference lifts before the knot and presses behind it: what
/// starts before bounces first, which is not followed.
TEST(KnotsAtInstants, WhereAContactIsLiftedOnTheOtherSide) {
  const RobotSystem ball =
      Make(Ball(),
           "{base: fixed, gravity: 0, constraints: {floor: {kind: lower_limit, joint: z, lower: "
           "0, restitution: 0.5}}, efforts: {a: {kind: track, joint: z, feed_forward: u, "
           "stiffness: 1, damping: 10, reference: {kind: linear, times: [0, 0.2, 0.5], values: "
           "[0, 0.2, -0.1]}}}, nominal: {positions: {z: 0, clock: 0.2}}}");
  const Trajectory run = Simulate(ball, ball.nominal().x, ball.nominal().u, 0.1, Tight());
  ASSERT_TRUE(run.arcs.front().mode.Contains(0));
  const BDerivative B = DifferentiateOutcome(ball, run, {});
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_TRUE(B(Vector::Unit(4, 1)).isApprox(Vector::Unit(4, 1), 1e-9));
  EXPECT_THROW(B(-Vector::Unit(4, 1)), std::invalid_argument);
}

TEST(KnotsAtInstants, WhereTheRunEnds) {
  const Case given{Follower("", 0.35), 0.15, Grid({0})};
  const BDerivative B = given.Differentiate();
  ExpectDirections(given, B, {0, 2});
  EXPECT_FALSE(B.IsDifferentiable());
  int refused = 0;
  for (double sign : {1.0, -1.0}) {
    const Vector w = sign * Vector::Unit(4, 1);
    try {
      EXPECT_LE((B(w) - given.Quotient(w)).cwiseAbs().maxCoeff(), 1e-4) << sign;
    } catch (const std::invalid_argument& reason) {
      ++refused;
      EXPECT_NE(std::string::npos, std::string(reason.what()).find("moves the clock over 'knot_2'"))
          << reason.what();
    }
  }
  EXPECT_EQ(1, refused);
}

TEST(KnotsAtInstants, WhereTheInputChanges) {
  const Case given{Follower(), 0.6, Grid({0, 0.2, 0.5})};
  const Trajectory run = given.Run(Vector::Zero(4));
  const BDerivative B = given.Differentiate();
  ExpectDirections(given, B, {0, 1, 2});
  EXPECT_TRUE(B.IsDifferentiable());
  // Interval by interval, and backward.
  Matrix product = Matrix::Identity(4, 4);
  for (const IntervalLinearization& interval : Linearize(given.system, run)) {
    ASSERT_TRUE(interval.status.ok()) << interval.status.message;
    product = interval.A * product;
  }
  for (int j : {0, 1, 2}) {
    EXPECT_LE((product.col(j) - B(Vector::Unit(4, j))).cwiseAbs().maxCoeff(), 1e-6) << j;
  }
  RunCost cost;
  cost.terminal = [](const Vector& end, Vector* gradient) {
    *gradient = Vector::Unit(4, 0);
    return end(0);
  };
  const CostGradient gradient = DifferentiateCost(given.system, run, cost, {});
  ASSERT_TRUE(gradient.status.ok()) << gradient.status.message;
  EXPECT_NEAR(B(Vector::Unit(4, 1))(0), gradient.initial(1), 1e-6);
}

/// Where the effort is on its limit on the way from one to the other, their order matters.
TEST(KnotsAtInstants, WhereChangesDoNotAddUpTheyAreRefused) {
  const Case given{Follower("limit: 3, "), 0.6, Grid({0, 0.2})};
  const Status status = given.Differentiate().status;
  EXPECT_EQ(Outcome::kNotDifferentiable, status.outcome) << status.message;
  EXPECT_NE(std::string::npos, status.message.find("knot")) << status.message;
}

TEST(KnotsAtInstants, WhereAMarkIsSetAndRead) {
  const std::shared_ptr<const RobotSystem> system(new RobotSystem(Follower()));
  OnlineFlow flow(system, 0, system->nominal().x, Vector::Constant(1, 1), Tight());
  flow.KeepMotion(true);
  while (flow.AdvanceTo(0.2)) {
  }
  Matrix directions = Matrix::Zero(4, 2);
  directions(0, 0) = directions(2, 1) = 1;
  RollingDerivative rolling(&flow, directions, {}, Tight());
  for (double t : {0.35, 0.5}) {
    bool passed = true;
    while (passed) {
      passed = flow.AdvanceTo(t);
      rolling.Follow(&flow, passed);
    }
    const RollingDerivative::Reading reading = rolling.Read(&flow);
    ASSERT_TRUE(reading.status.ok()) << t << reading.status.message;
    const Case rest{Follower("", 0.2), t - 0.2, Grid({0})};  // its gaps are linear
    EXPECT_LE((reading.tangents.col(0) - rest.Quotient(Vector::Unit(4, 0))).norm(), 1e-4);
  }
}

/// What follows a reference that it is on feeds nothing back, though nobody tells of its knots, nor
/// behind its last one or before its first.
TEST(KnotsAtInstants, AreNoEventsOfAPolicy) {
  const std::shared_ptr<const RobotSystem> system(new RobotSystem(Follower()));
  const InputSchedule inputs = Grid({0, 0.2, 0.3, 0.5});
  const Trajectory run = Simulate(*system, system->nominal().x, inputs, 1.0, Tight());
  TrackingWeights weights{Vector::Constant(4, 1000), Vector::Constant(1, 0.01), Vector::Ones(4)};
  const TrackingPolicy policy = MakePolicy(*system, run, inputs, 0.1, weights);
  EXPECT_EQ(1u, policy.reference.phases().size());
  EXPECT_EQ(3, policy.reference.instants().Size());
  PolicyTracker tracker(policy);
  OnlineFlow flow(system, 0, system->nominal().x, Vector::Constant(1, 1), Tight());
  for (int k = 0; k < 1000; ++k) {
    const double t = 1e-3 * k;
    while (flow.AdvanceTo(t)) {
      const Transition& event = flow.transition();
      tracker.Observe(event.t, event.activated, event.released, event.mode_after);
    }
    const Vector u = tracker.Input(t, flow.State());
    ASSERT_NEAR(policy.reference.Input(t)(0), u(0), 1e-6) << t;
    flow.SetInput(t, u);
  }
  EXPECT_TRUE(tracker.events().empty());
}

}  // namespace
}  // namespace contact_flow
