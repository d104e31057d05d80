// SPDX-License-Identifier: BSD-3-Clause
// Controllers of robots: limits, gravity compensation, feedback of the state, springs between
// frames, each against a closed form or a computation of its own.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "test/io/controlled_robots.h"

namespace contact_flow {
namespace {

using test::Arm;
using test::Cart;
using test::ExpectSlopeOne;
using test::Joint;
using test::Link;
using test::Make;
using test::Refusal;
using test::Robot;
using test::Tight;

/// From rest at 0 towards 1 with k = 20, at most 8 N on 2 kg: 4 m/s² up to x = 0.6, then a swing
/// about 1 with ω² = 10 up to 1.4, then −4 m/s².
TEST(Limits, OfAServoAreLeftAndReached) {
  const std::string yaml =
      "{efforts: {s: {kind: servo, joint: x, input: u, stiffness: 20, limit: 8}}, "
      "nominal: {inputs: {u: 1}}, parameters: {limit: s/limit, k: s/stiffness}}";
  const RobotSystem system = Make(Cart(), yaml);
  const double first = std::sqrt(2 * 0.6 / 4), speed = 4 * first, omega = std::sqrt(10.0);
  // y = −0.4 cos + speed/ω sin reaches 0.4 at ω t = 2 atan(0.4 ω/speed).
  const double second = 2 * std::atan(0.4 * omega / speed) / omega, third = 0.2;
  const Trajectory run =
      Simulate(system, system.nominal().x, system.nominal().u, first + second + third, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  // A corner inside a step is met by the error control alone: a few times the tolerance.
  EXPECT_NEAR(1.4 + speed * third - 2 * third * third, run.FinalState()(0), 1e-10);
  EXPECT_NEAR(speed - 4 * third, run.FinalState()(1), 1e-10);
  ExpectSlopeOne(Cart(), yaml, first + second + third);
}

/// What rests on its limit has no derivative by its input: none to one side.
TEST(Limits, AnInputThatIsTheLimitIsRefused) {
  const RobotSystem system =
      Make(Cart(),
           "{efforts: {s: {kind: actuator, joint: x, input: u, gear: 2, limit: 8}}, "
           "nominal: {inputs: {u: 4}}}");
  const Trajectory run = Simulate(system, system.nominal().x, system.nominal().u, 0.5, Tight());
  ASSERT_TRUE(run.status.ok());
  BDerivativeOptions options;
  EXPECT_TRUE(DifferentiateOutcome(system, run, options).status.ok());
  options.variables.inputs = true;
  EXPECT_FALSE(DifferentiateOutcome(system, run, options).status.ok());
}

/// An arm on the world that bears a share s of its weight moves as under gravity (1 − s) g.
TEST(GravityCompensation, IsLessGravity) {
  const std::string end =
      ", nominal: {positions: {shoulder: 0.7, elbow: -1.1}, velocities: {elbow: 2}}, "
      "parameters: {m: links/lower/mass, z: links/lower/z, g: gravity}}";
  const std::string borne = "{gravity_compensation: {share: 0.75}" + end;
  const RobotSystem one = Make(Arm(), borne), other = Make(Arm(), "{gravity: 2.4525" + end);
  std::vector<Vector> outcomes, derivatives;
  for (const RobotSystem* system : {&one, &other}) {
    const Trajectory run = Simulate(*system, system->nominal().x, Vector(0), 0.9, Tight());
    ASSERT_TRUE(run.status.ok());
    outcomes.push_back(run.FinalState());
    BDerivativeOptions options;
    options.variables.parameters = {0, 1};
    options.tolerance = 1e-11;
    const BDerivative B = DifferentiateOutcome(*system, run, options);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    Vector w(6);
    w << 0.3, -0.4, 0.2, 0.7, 1.1, -0.6;
    derivatives.push_back(B(w));
  }
  EXPECT_LT((outcomes[0] - outcomes[1]).norm(), 1e-10);
  EXPECT_LT((derivatives[0] - derivatives[1]).norm(), 1e-8);
  ExpectSlopeOne(Arm(), borne, 0.9);
  const RobotSystem held = Make(Arm(),
                                "{gravity_compensation: {joints: [shoulder, elbow]}, "
                                "nominal: {positions: {shoulder: 0.7, elbow: -1.1}}}");
  const Trajectory run = Simulate(held, held.nominal().x, Vector(0), 2);
  EXPECT_LT((run.FinalState() - held.nominal().x).norm(), 1e-12);
}

/// ẍ = (u₀ − k (x − x_ref) − c (ẋ − v_ref))/m is a linear system: x(t) and its derivative e^{At}.
TEST(Feedback, ClosesTheLoop) {
  const std::string yaml =
      "{efforts: {s: {kind: actuator, joint: x, input: u}}, nominal: {positions: {x: 0.3}, "
      "inputs: {u: 0.5}}, feedback: {reference: {positions: {x: 0.1}, velocities: {x: 0.2}}, "
      "gains: {u: {positions: {x: 8}, velocities: {x: 2}}}}}";
  const RobotSystem system = Make(Cart(), yaml);
  const double m = 2, k = 8, c = 2, t = 0.8, decay = c / (2 * m);
  const double omega = std::sqrt(k / m - decay * decay), rest = 0.1 + (0.5 + c * 0.2) / k;
  const double e = std::exp(-decay * t), cosine = std::cos(omega * t);
  const double sine = std::sin(omega * t) / omega;
  Eigen::Matrix2d A;
  A << cosine + decay * sine, sine, -k / m * sine, cosine - decay * sine;
  A *= e;
  const Trajectory run = Simulate(system, system.nominal().x, system.nominal().u, t, Tight());
  ASSERT_TRUE(run.status.ok());
  const Eigen::Vector2d x = A * Eigen::Vector2d(0.3 - rest, 0) + Eigen::Vector2d(rest, 0);
  EXPECT_LT((run.FinalState() - x).norm(), 1e-11);
  const BDerivative B = DifferentiateOutcome(system, run);
  for (int j = 0; j < 2; ++j) EXPECT_LT((B(Vector::Unit(2, j)) - A.col(j)).norm(), 1e-9);
  // The row of K as a list is the same.
  const RobotSystem listed =
      Make(Cart(),
           "{efforts: {s: {kind: actuator, joint: x, input: u}}, feedback: {reference: "
           "{positions: {x: 0.1}, velocities: {x: 0.2}}, gains: {u: [8, 2]}}}");
  EXPECT_EQ(run.FinalState(),
            Simulate(listed, system.nominal().x, system.nominal().u, t, Tight()).FinalState());
}

/// A free body turned by its own torque through rotors is beyond a short test; its error is not.
/// About the reference, turned by θ about n in its own axes, it is sin θ n.
TEST(Feedback, SeesTheSineOfARotation) {
  StateFeedback feedback;
  ConfigurationSpace space;
  space.Append(ConfigurationSpace::Factor::kLine, 2).Append(ConfigurationSpace::Factor::kRotation);
  feedback.q = Vector(6);
  feedback.q << 0.1, -4, 0.8, 0.36, 0, 0.48;
  for (const double theta : {1e-4, 0.7, 2.5, 3.14}) {
    Vector eta = Vector::Zero(5);
    eta << 0.2, 7, theta * Vec3<double>(0.48, -0.6, 0.64);
    const Vector q = space.Retract(feedback.q, eta);
    Vector error, expected = eta;
    expected.tail<3>() *= std::sin(theta) / theta;
    feedback.Error(space, q, &error);
    EXPECT_LT((error - expected).norm(), 1e-14);
  }
}

/// Between two bodies that float it pulls with internal forces alone: momenta stay, energy falls.
TEST(FrameSpring, KeepsTheMomenta) {
  const std::string urdf =
      "<robot name=\"r\">" + Link("a", "1.5", "0.1") + Link("b", "0.8", "-0.2") +
      "<joint name=\"j\" type=\"floating\"><parent link=\"a\"/><child link=\"b\"/></joint></robot>";
  const std::string start =
      "{base: floating, gravity: 0, contacts: {ground: none}, nominal: {positions: {j_x: 0.5, "
      "j_z: 0.2, j_qw: 0.6, j_qy: 0.8}, velocities: {base_x: 0.4, base_wx: 1, j_wz: 2, j_y: "
      "0.5}}, efforts: {s: {kind: frame_spring, link: a, point: [0.1, 0, 0.2], other_link: b, "
      "other_point: [0, 0.2, 0], stiffness: 20, damping: 1, turn_stiffness: 5, turn_damping: "
      "0.3}}, parameters: {k: s/turn_stiffness, c: s/turn_damping, d: s/damping}}";
  const RobotSystem system = Make(urdf, start);
  const auto momenta = [&](const Vector& x) {
    Matrix mass;
    Vector force;
    system.Dynamics(x.head(14), x.tail(12), Vector(0), ContactMode(), &mass, &force);
    const Vector p = mass * x.tail(12);  // of all, in world axes, and about the base in its axes
    Eigen::Matrix<double, 7, 1> all;
    const Vec3<double> linear = p.head<3>(), r = x.head<3>();
    all << linear, r.cross(linear) + QuaternionRotation(x.data() + 3) * p.segment<3>(3),
        0.5 * x.tail(12).dot(p);
    return all;
  };
  const Trajectory run = Simulate(system, system.nominal().x, Vector(0), 1.5, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const auto before = momenta(system.nominal().x), after = momenta(run.FinalState());
  EXPECT_LT((before - after).head<6>().norm(), 1e-9);
  EXPECT_GT(std::abs(before(6) - after(6)), 1e-2);
}

/// A pendulum without weight, I θ̈ = −k sin θ − c θ̇, by Runge and Kutta's rule.
TEST(FrameSpring, TurnsBackByTheSine) {
  const std::string urdf =
      Robot(Link("w", "2") + Joint("turn", "continuous", "world", "w", "0 0 1"));
  const std::string yaml =
      "{nominal: {positions: {turn: 2.6}}, efforts: {s: {kind: frame_spring, link: w, other_link: "
      "world, stiffness: 9, damping: 1, turn_stiffness: 5, turn_damping: 0.3}}, parameters: {k: "
      "s/turn_stiffness, c: s/turn_damping}}";
  const RobotSystem system = Make(urdf, yaml);
  const double duration = 1.2, h = 1e-4;
  double angle = 2.6, rate = 0;
  const auto f = [](double a, double r) { return -(5 * std::sin(a) + 0.3 * r) / 0.5; };
  for (int i = 0; i < 12000; ++i) {
    const double a1 = rate, r1 = f(angle, rate), a2 = rate + h / 2 * r1,
                 r2 = f(angle + h / 2 * a1, a2), a3 = rate + h / 2 * r2,
                 r3 = f(angle + h / 2 * a2, a3), a4 = rate + h * r3, r4 = f(angle + h * a3, a4);
    angle += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    rate += h / 6 * (r1 + 2 * r2 + 2 * r3 + r4);
  }
  const Trajectory run = Simulate(system, system.nominal().x, Vector(0), duration, Tight());
  EXPECT_NEAR(angle, run.FinalState()(0), 1e-10);
  EXPECT_NEAR(rate, run.FinalState()(1), 1e-10);
  ExpectSlopeOne(urdf, yaml, duration);
}

TEST(RobotControl, RefusesWithLineValueAndRemedy) {
  const std::string track = "efforts:\n  t: {kind: track, joint: x, feed_forward: f, stiffness: 1";
  const struct {
    std::string yaml;
    std::vector<const char*> words;
  } cases[] = {
      {track + "}", {"'reference' is missing", "line 2"}},
      {track + ", reference: {times: [0, 1]}}", {"'values' is missing", "line 2"}},
      {track + ", reference: {times: [0, 1], values: [0]}}",
       {"2 times and 1 values", "t/reference", "line 2"}},
      {track + ", reference: {times: [0, 1, 1], values: [0, 1, 2]}}",
       {"time 3 is not after", "line 2"}},
      {track + ", reference: {times: [0, x], values: [0, 1]}}", {"times[1] is 'x'", "line 2"}},
      {track + ", reference: {times: [0, 1, 2, 3], values: [0, 1, 2, 1], periodic: true}}",
       {"ends at 1", "line 2"}},
      {track + ", reference: {kind: linear, times: [0, 1, 2, 3], values: [0, 1, 2, 0], periodic: "
               "true}}",
       {"take kind: cubic"}},
      {track + ", limit: -1, reference: {times: [0, 1], values: [0, 1]}}",
       {"limit", "-1", "line 2"}},
      {"efforts: {s: {kind: servo, joint: clock, input: u, stiffness: 1}}",
       {"unknown joint 'clock'"}},
      {"feedback: {}", {"'gains' is missing"}},
      {"feedback: {gains: {u: {positions: {x: 1}}}}", {"unknown input 'u'"}},
      {"efforts: {s: {kind: actuator, joint: x, input: u}}\nfeedback: {gains: {u: [1, 2, 3]}}",
       {"feedback/gains/u", "a list of 2 numbers", "line 2"}},
      {"efforts: {s: {kind: actuator, joint: x, input: u}}\nfeedback: {gains: {u: {positions: "
       "{y: 1}}}}",
       {"unknown key 'y'", "'x'", "line 2"}},
      {"gravity_compensation: {joints: [knee]}", {"unknown joint 'knee'", "line 1"}},
  };
  for (const auto& mistake : cases) {
    const std::string answer = Refusal(Cart(), mistake.yaml);
    for (const char* words : mistake.words) {
      EXPECT_NE(std::string::npos, answer.find(words))
          << "\"" << answer << "\" lacks \"" << words << "\"; of " << mistake.yaml;
    }
  }
}

}  // namespace
}  // namespace contact_flow
