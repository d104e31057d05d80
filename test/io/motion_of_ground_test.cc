// SPDX-License-Identifier: BSD-3-Clause
// Motions of ground as YAML gives them: their derivatives beside quotients, terrain, refusals.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "test/io/moving_robots.h"

namespace contact_flow {
namespace {

using test::Block;
using test::ExpectQuotients;
using test::Joint;
using test::Link;
using test::Make;
using test::Refusal;
using test::Robot;

/// A block that lands on a slope that samples move, and slips; and a wheel.
TEST(MovingGround, HasTheDerivativeOfQuotients) {
  ExpectQuotients(
      Block(),
      "{constraints: {block: {kind: plane, link: block, normal: [-0.2, 0, 1], friction: 0.2, "
      "motion: {direction: [0.4, 0, 1], velocity: 0.2, times: [0, 0.2, 0.35, 0.6], values: [0, "
      "0.05, 0.01, 0.04]}}}, nominal: {positions: {z: 0.2}, velocities: {x: 1}}, parameters: "
      "{velocity: block/motion_velocity, across: block/motion_direction_x, mu: block/friction, "
      "offset: block/offset}}",
      0.4);
  ExpectQuotients(
      Robot(Link("mid", "0.5") + Link("high", "0.5") + Link("wheel", "1") +
            Joint("x", "prismatic", "world", "mid", "1 0 0") +
            Joint("z", "prismatic", "mid", "high", "0 0 1") +
            Joint("roll", "continuous", "high", "wheel", "0 1 0")),
      "{constraints: {rim: {kind: rim, link: wheel, axis: [0, 1, 0], radius: 0.2, friction: 0.4, "
      "motion: {direction: [1, 0, 0.5], amplitude: 0.05, frequency: 2, phase: 1}}}, nominal: "
      "{positions: {z: 0.4}, velocities: {x: 0.5, roll: -3}}, parameters: {amplitude: "
      "rim/motion_amplitude, phase: rim/motion_phase, radius: rim/radius}}",
      0.3);
}

/// A carriage lands on a plane that rises at 0.3 m/s, at 1.7e-4 m/s beside it, which throws up a
/// mass that is pressed to its stop: at once back, it is taken to rest. The work of the plane on
/// that is no gain of the impact. All of z takes m (v − w + g T) from the plane until T, with the
/// speed w at the start, and so x loses μ times that.
TEST(MovingGround, WorksOnWhatItMakesRest) {
  const double mu = 0.3, moved = 2, all = 2.5, end = 0.2;
  const RobotSystem robot = Make(
      Robot(Link("mid", "0.5") + Link("carriage", "1") + Link("mass", "1") +
            Joint("x", "prismatic", "world", "mid", "1 0 0") +
            Joint("z", "prismatic", "mid", "carriage", "0 0 1") +
            Joint("lift", "prismatic", "carriage", "mass", "0 0 1")),
      "{gravity: 0.1, constraints: {foot: {kind: plane, link: carriage, friction: 0.3, motion: "
      "{direction: [0, 0, 1], velocity: 0.3}}, stop: {kind: upper_limit, joint: lift, upper: "
      "0}}, efforts: {press: {kind: actuator, joint: lift, input: u}}, nominal: {positions: "
      "{z: 1.e-7}, velocities: {x: 0.05, z: 0.2999}, inputs: {u: 1000}}}");
  Vector x = robot.nominal().x;
  const Trajectory run = Simulate(robot, x, robot.nominal().u, end);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  ASSERT_GT(run.transitions[0].rest_impulse.size(), 0);
  const int d = robot.dof();
  EXPECT_NEAR(0.05 - mu * moved / all * (1e-4 + 0.1 * end), run.FinalState().tail(d)(0), 1e-8);
  const BDerivative B = DifferentiateOutcome(robot, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_LT(B.trust.energy, 1e-9);
  const Vector by_height = B(Vector::Unit(2 * d, 1)), by_speed = B(Vector::Unit(2 * d, d + 1));
  EXPECT_NEAR(0, by_height(d), 1e-5);
  EXPECT_NEAR(mu * moved / all, by_speed(d), 1e-5);
}

/// A mass on a shaker, z = 1.5 t + A sin ωt: by A it starts elsewhere, and the clock goes on at
/// its rate.
TEST(MovingGround, DirectionsAreProjectedAtTheRateOfTheClock) {
  const double amplitude = 0.02, omega = 2 * 3.14159265358979323846 * 1.5, clock = 0.05, end = 0.3;
  const RobotSystem robot = Make(
      Robot(Link("mass", "1") + Joint("z", "prismatic", "world", "mass", "0 0 1")),
      "{constraints: {mass: {kind: plane, link: mass, motion: {direction: [0, 0, 1], velocity: "
      "1.5, amplitude: 0.02, frequency: 1.5}}}, parameters: {amplitude: mass/motion_amplitude}}");
  Vector x(4);  // z, clock
  x << 1.5 * clock + amplitude * std::sin(omega * clock), clock,
      1.5 + amplitude * omega * std::cos(omega * clock), 1;
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  const Trajectory run = Simulate(robot, x, robot.nominal().u, end, options);
  BDerivativeOptions with;
  with.variables.parameters = ParameterIndices(robot.description(), {"amplitude"});
  const BDerivative B = DifferentiateOutcome(robot, run, with);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const Vector w =
      ProjectAdmissible(robot, x, run.arcs.front().mode, Vector::Unit(5, 4), with.variables);
  EXPECT_EQ(0, w(3)) << w.transpose();
  const double later = clock + end, rate = 1.5 + amplitude * omega * std::cos(omega * later);
  EXPECT_NEAR(std::sin(omega * later) + rate * w(1), B(w)(0), 1e-7) << "the clock is ahead by w(1)";
}

/// Terrain that contacts are made with moves, too, and is shared.
TEST(MovingGround, IsTerrain) {
  const RobotSystem robot = Make(
      "<robot name=\"b\"><link name=\"box\"><inertial><mass value=\"1\"/><inertia ixx=\"0.1\" "
      "iyy=\"0.1\" izz=\"0.1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial><collision><geometry>"
      "<box size=\"0.2 0.2 0.1\"/></geometry></collision></link></robot>",
      "{base: floating, contacts: {ground: all, friction: 0.6}, terrain: {belt: {kind: plane, "
      "motion: {direction: [0, 1, 0], velocity: 0.8}}}, nominal: {positions: {base_z: 0.06}, "
      "duration: 1}}");
  EXPECT_EQ(8, robot.num_constraints());
  const Trajectory run = Simulate(robot, robot.nominal().x, robot.nominal().u, 1);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const int y = robot.num_positions() + 1;
  EXPECT_NEAR(0.8, run.FinalState()(y), 1e-6);
}

TEST(MovingGround, IsRefusedWhereItIsNone) {
  const auto refusal = [](const std::string& kind, const std::string& motion) {
    return Refusal(Block(), "constraints:\n  block: {link: block, kind: " + kind +
                                ",\n    motion: {" + motion + "}}\n");
  };
  const struct {
    const char *kind, *motion, *answer;
  } cases[] = {
      {"plane", "velocity: 1", "block/motion: 'direction' is missing"},
      {"plane", "direction: [1, 0, 0]", "says no motion: add `velocity`"},
      {"plane", "direction: [0, 0, 0], velocity: 1", "has no direction: give one"},
      {"plane", "direction: [1, 0, 0], amplitude: 1", "needs a `frequency` [Hz] (line 3)"},
      {"plane", "direction: [1, 0, 0], velocity: 1, phase: 1", "is of a sinusoid: add its"},
      {"plane", "direction: [1, 0, 0], velocity: 1, periodic: true", "is of samples: add"},
      {"plane", "direction: [1, 0, 0], times: [0, 1], values: [0]", "2 times and 1 values"},
      {"plane", "direction: [1, 0, 0], speed: 1", "says no motion"},
      {"plane", "direction: [1, 0, 0], velocity: 1, frequncy: 1", "unknown key 'frequncy'"},
      {"link_plane, other_link: mid", "direction: [1, 0, 0], velocity: 1", "is for ground"},
      {"link_plane, other_link: block", "direction: [1, 0, 0], velocity: 1", "is for ground"},
      {"plane, friction: 0.5", "direction: [0, 1, 0], velocity: 1", "moves out of the plane"},
  };
  for (const auto& wrong : cases) {
    const std::string answer = refusal(wrong.kind, wrong.motion);
    EXPECT_NE(std::string::npos, answer.find(wrong.answer)) << answer;
    EXPECT_NE(std::string::npos, answer.find("(line ")) << answer;
  }
  const std::string still = "<robot name=\"s\"><link name=\"world\"/>" + Link("post", "1") +
                            Link("arm", "1") +
                            "<joint name=\"f\" type=\"fixed\"><parent link=\"world\"/><child "
                            "link=\"post\"/></joint>" +
                            Joint("z", "prismatic", "post", "arm", "0 0 1") + "</robot>";
  EXPECT_NE(std::string::npos,
            Refusal(still,
                    "{constraints: {post: {kind: plane, link: post, motion: {direction: [0, "
                    "0, 1], velocity: 1}}}}")
                .find("between parts that do not move"));
}

}  // namespace
}  // namespace contact_flow
