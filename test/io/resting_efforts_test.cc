// SPDX-License-Identifier: BSD-3-Clause
// Efforts that rest right on their limit: where that matters to nothing there is a derivative,
// where it matters on the one side alone that of this side, and else none, whoever asks.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/derivative/linearization.h"
#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "contact_flow/trajectory_optimization/policy.h"
#include "test/io/moving_robots.h"

namespace contact_flow {
namespace {

using test::Ball;
using test::Block;
using test::ExpectRefused;
using test::Joint;
using test::Link;
using test::Make;
using test::Robot;
using test::RunOf;
using test::Text;
using test::Tight;

BDerivative DerivativeOf(const RobotSystem& system, double duration, bool inputs = false) {
  BDerivativeOptions options;
  options.variables.inputs = inputs;
  return DifferentiateOutcome(system, RunOf(system, duration), options);
}
std::shared_ptr<const RobotSystem> Share(const std::string& urdf, const std::string& yaml) {
  return std::shared_ptr<const RobotSystem>(new RobotSystem(Make(urdf, yaml)));
}
/// The reading of an online run after `duration`, along one direction.
RollingDerivative::Reading Roll(const std::shared_ptr<const RobotSystem>& system, const Vector& w,
                                double duration, const Variables& variables) {
  const SimulateOptions options = Tight();
  OnlineFlow flow(system, 0, system->nominal().x, system->nominal().u, options);
  BDerivativeOptions derivative;
  derivative.variables = variables;
  RollingDerivative rolling(&flow, w, derivative, options);
  for (bool passed = true; passed;) {
    passed = flow.AdvanceTo(duration);
    rolling.Follow(&flow, passed);
  }
  return rolling.Read(&flow);
}

/// A ball of 1 kg above a stop, driven by efforts, and more.
std::string AboveStop(const std::string& efforts, const std::string& more) {
  return "{base: fixed, constraints: {stop: {kind: lower_limit, joint: z, lower: 0}}, efforts: {" +
         efforts + "}, " + more + "}";
}
/// Its drive, pushed by a feedback whose reference is the stop, with the input right on the limit.
std::string Held(double limit, const std::string& gains, double height) {
  return AboveStop("a: {kind: actuator, joint: z, input: u, limit: " + Text(limit) + "}",
                   "feedback: {gains: {u: {" + gains +
                       "}}}, nominal: {positions: {z: " + Text(height) + "}, inputs: {u: 5}}");
}

/// The ball falls onto the stop, or stands there, and its drive pushes less than its weight: it
/// stays, whatever the drive does.
TEST(RestingOnALimit, WhereNothingMoves) {
  for (const std::string gains : {"positions: {z: 7}", "positions: {z: 7}, velocities: {z: 1}"}) {
    for (const double height : {0.0, 0.3}) {
      for (const double limit : {5.0, 5.001, 4.999}) {
        const RobotSystem ball = Make(Ball(), Held(limit, gains, height));
        const BDerivative B = DerivativeOf(ball, 0.5);
        ASSERT_TRUE(B.status.ok()) << B.status.message;
        ASSERT_TRUE(B.arcs.back().allFinite());
        if (height == 0) continue;  // no direction is admitted
        for (int k = 0; k < 2; ++k) {
          EXPECT_LT(B(Vector::Unit(2, k)).norm(), 1e-9) << gains << limit;
        }
        EXPECT_TRUE(Linearize(ball, RunOf(ball, 0.5)).size() == 1);
        const auto shared = Share(Ball(), Held(limit, gains, height));
        const auto reading = Roll(shared, Vector::Unit(2, 0), 0.5, {});
        ASSERT_TRUE(reading.status.ok()) << reading.status.message;
        EXPECT_LT(reading.tangents.norm(), 1e-9);
      }
    }
  }
}

/// By the input, too: on the stop its force changes, and nothing else.
TEST(RestingOnALimit, OfAServoOnItsStop) {
  const RobotSystem ball =
      Make(Ball(), AboveStop("a: {kind: servo, joint: z, input: u, stiffness: 10, limit: 5}",
                             "nominal: {positions: {z: 0.3}, inputs: {u: -0.5}}"));
  const BDerivative B = DerivativeOf(ball, 0.5, true);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_LT(B(Vector::Unit(3, 2)).norm(), 1e-9);
}

/// Where the force lifts the ball it matters when: a pull of 40 N/m · 0.3 m/s rises to the 5 N of
/// the servo. With a higher limit it comes later by the input, with a lower one it does not.
TEST(RestingOnALimit, WhereTheForceDecides) {
  for (const double limit : {5.0, 5.001, 4.999}) {
    const std::string yaml =
        "{base: fixed, gravity: 0, constraints: {stop: {kind: lower_limit, joint: z, lower: 0}}, "
        "efforts: {a: {kind: servo, joint: z, input: u, stiffness: 10, limit: " +
        Text(limit) +
        "}, pull: {kind: track, joint: z, feed_forward: f, stiffness: 40, reference: {times: [0, "
        "1], values: [0, 0.3]}}}, nominal: {inputs: {u: -0.5}}}";
    const auto ball = Share(Ball(), yaml);
    const double duration = 0.6;
    const Trajectory run = RunOf(*ball, duration);
    ASSERT_EQ(1u, run.transitions.size()) << "it lets go";
    Variables variables;
    variables.inputs = true;
    BDerivativeOptions options;
    options.variables = variables;
    const BDerivative B = DifferentiateOutcome(*ball, run, options);
    const Eigen::Index n = 2 * ball->dof() + 2;
    const Vector w = Vector::Unit(n, n - 2);
    const auto reading = Roll(ball, w, duration, variables);
    if (limit == 5) {
      ExpectRefused(B.status, "the effort 'a' is right on its limit");
      ExpectRefused(reading.status, "the effort 'a' is right on its limit");
      continue;
    }
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    ASSERT_TRUE(reading.status.ok()) << reading.status.message;
    EXPECT_EQ(limit > 5, B(w).head(1).norm() > 1e-3) << limit;
    EXPECT_LT((B(w) - reading.tangents).norm(), 1e-7);
  }
}

/// A weak feedback beside a spring of 1e6 N/m: the two sides differ in the sixth digit.
TEST(RestingOnALimit, BesideAStiffSpring) {
  const RobotSystem ball = Make(
      Ball(),
      "{base: fixed, gravity: 0, efforts: {spring: {kind: joint_spring, joint: z, stiffness: 1e6, "
      "damping: 100, rest: -5e-6}, a: {kind: actuator, joint: z, input: u, limit: 5}}, feedback: "
      "{gains: {u: {positions: {z: 7}}}}, nominal: {inputs: {u: 5}}}");
  ExpectRefused(DerivativeOf(ball, 0.1).status, "the effort 'a' is right on its limit");
}

/// 1 kg that its motor just holds, saturated: v' = −5/4 v upward, and 0 downward.
TEST(RestingOnALimit, UnderTheRollingDerivative) {
  const auto ball =
      Share(Ball(),
            "{base: fixed, gravity: 5, efforts: {a: {kind: servo, joint: z, input: u, stiffness: "
            "100, damping: 1, limit: 5, speed: 4}}, nominal: {inputs: {u: 5}}}");
  for (const double sign : {1.0, -1.0}) {
    ExpectRefused(Roll(ball, sign * Vector::Unit(2, 1), 0.5, {}).status, "the effort 'a");
  }
}

/// What derivatives of runs are refused for, readings are: a block of 0.5 kg that its drive just
/// bears when it has landed; one without friction, of which friction is a variable, at rest; and a
/// puck on four feet that slides in space, but for one that slides on a single foot.
TEST(RollingDerivative, IsRefusedLikeThatOfTheRun) {
  const auto block = [](double mu, double height, double u) {
    return Share(Block(),
                 "{base: fixed, gravity: 10, constraints: {floor: {kind: plane, link: block, "
                 "point: [0, 0, 0], friction: " +
                     Text(mu) +
                     "}}, parameters: {mu: floor/friction}, efforts: {a: {kind: actuator, joint: "
                     "z, input: u}}, nominal: {positions: {z: " +
                     Text(height) + "}, velocities: {z: " + Text(-20 * height) +
                     "}, inputs: {u: " + Text(u) + "}}}");
  };
  const auto puck = [](int feet) {
    std::string constraints;
    for (int k = 0; k < feet; ++k) {
      constraints += "f" + std::to_string(k) + ": {kind: plane, link: puck, point: [" +
                     (k % 2 == 0 ? "-1, " : "1, ") + (k / 2 == 0 ? "-1" : "1") +
                     ", 0], friction: 0.5}, ";
    }
    return Share(Robot(Link("a", "0.5") + Link("b", "0.5") + Link("puck", "1") +
                       Joint("x", "prismatic", "world", "a", "1 0 0") +
                       Joint("y", "prismatic", "a", "b", "0 1 0") +
                       Joint("z", "prismatic", "b", "puck", "0 0 1")),
                 "{base: fixed, gravity: 8, constraints: {" + constraints +
                     "}, nominal: {velocities: {x: 1}}}");
  };
  Variables inputs, friction;
  inputs.inputs = true;
  friction.parameters = {0};
  const struct {
    std::shared_ptr<const RobotSystem> refused, answered;
    Variables variables;
    std::string why;
  } cases[] = {{block(0.5, 0.05, 5), block(0.5, 0.05, 4), inputs, "neither pressed nor lifted"},
               {block(0, 0, 4), block(0.1, 0, 4), friction, "does not slip one way"},
               {puck(4), puck(1), {}, "share their forces"}};
  for (const auto& c : cases) {
    SCOPED_TRACE(c.why);
    const Eigen::Index n = 2 * c.refused->dof() + c.variables.Size(*c.refused);
    const Vector w = n == 6 ? Vector::Unit(n, 0) : Vector::Unit(n, n - 1);
    BDerivativeOptions options;
    options.variables = c.variables;
    ExpectRefused(DifferentiateOutcome(*c.refused, RunOf(*c.refused, 0.1), options).status, c.why);
    ExpectRefused(Roll(c.refused, w, 0.1, c.variables).status, c.why);
    const Status status = Roll(c.answered, w, 0.1, c.variables).status;
    EXPECT_TRUE(status.ok()) << status.message;
  }
}

/// A sledge on a spring carries an arm that its motor presses on a stop, saturated: the stop takes
/// up what the motor does, and the arm moves with the sledge, √(30/2) rad/s.
TEST(RestingOnALimit, OfAMotorOnItsStopWhileOthersMove) {
  const std::string urdf =
      Robot(Link("sledge", "1") +
            "<link name='arm'><inertial><origin xyz='0.1 0 -0.3'/><mass value='1'/><inertia "
            "ixx='0.1' iyy='0.1' izz='0.1' ixy='0' ixz='0' iyz='0'/></inertial></link>" +
            Joint("x", "prismatic", "world", "sledge", "1 0 0") +
            Joint("a", "continuous", "sledge", "arm", "0 1 0"));
  const double omega = std::sqrt(15.0), t = 0.5;
  for (const std::string limit : {"limit: 5, speed: 4", "limit: 5, speed: 4, stall: 5.001"}) {
    const RobotSystem robot = Make(
        urdf,
        "{base: fixed, constraints: {stop: {kind: lower_limit, joint: a, lower: 0}}, efforts: "
        "{spring: {kind: joint_spring, joint: x, stiffness: 30}, motor: {kind: servo, joint: a, "
        "input: u, stiffness: 100, damping: 1, " +
            limit + "}}, nominal: {positions: {x: 0.1}, inputs: {u: -1}}}");
    const BDerivative B = DerivativeOf(robot, t);
    ASSERT_TRUE(B.status.ok()) << limit << B.status.message;
    const Vector by_x = B(Vector::Unit(4, 0)), by_v = B(Vector::Unit(4, 2));
    EXPECT_NEAR(std::cos(omega * t), by_x(0), 1e-7);
    EXPECT_NEAR(std::sin(omega * t) / omega, by_v(0), 1e-7);
    EXPECT_NEAR(-omega * std::sin(omega * t), by_x(2), 1e-7);
    EXPECT_EQ(0, by_x(1));
  }
}

/// A mass of 1 kg is to be thrown as fast as 0.3 N for 1 s allow, the bound being the limit: both
/// intervals on it. The gradient there is that of the side within.
TEST(RestingOnALimit, WhereTheBoundIsTheLimit) {
  for (const double gear : {3.0, -3.0}) {
    for (const bool led : {false, true}) {
      const RobotSystem ball =
          Make(Ball(),
               "{base: fixed, gravity: 0, efforts: {a: {kind: actuator, joint: z, input: "
               "u, gear: " +
                   Text(gear) + ", limit: 0.3}}}");
      TrajectoryProblem problem;
      problem.x = Vector::Zero(2);
      problem.inputs.grid = {0, 0.5};
      problem.inputs.values = {Vector::Zero(1), Vector::Zero(1)};
      problem.linear_inputs = led;
      problem.duration = 1;
      problem.effort = Vector::Constant(1, 1e-3);
      problem.weight = Eigen::Vector2d(0, 1);
      problem.target = Eigen::Vector2d(0, 1);
      problem.lower = Vector::Constant(1, -0.1);
      problem.upper = Vector::Constant(1, 0.1);
      const TrajectoryOptimum found = OptimizeTrajectory(ball, problem);
      EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
      EXPECT_NEAR(0.49 + 1e-5, found.cost, 1e-9);
      // Without the bounds it has two sides.
      const Trajectory run = Simulate(ball, problem.x, found.inputs, 1, Tight());
      if (!led) {
        BDerivativeOptions options;
        options.variables.inputs = true;
        ExpectRefused(DifferentiateOutcome(ball, run, options).status, "right on its limit");
        const Unknowns unknowns(ball, problem);
        const Vector on = Vector::Constant(2, gear > 0 ? 0.1 : -0.1);
        const TrackingWeights weights{Vector::Ones(2), Vector::Ones(1), Vector::Ones(2)};
        EXPECT_THROW(MakePolicy(ball, run, found.inputs, 0.1, weights), NoPolicy);
        const TrackingPolicy policy =
            MakePolicy(ball, run, found.inputs, 0.1, weights, {}, unknowns.ConesOfInputs(on));
        EXPECT_GT(policy.gains[0].cwiseAbs().maxCoeff(), 0.1);
        // What leads beyond counts.
        EXPECT_THROW(
            MakePolicy(ball, run, found.inputs, 0.1, weights, {}, unknowns.ConesOfInputs(-on)),
            NoPolicy);
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
