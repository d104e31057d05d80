// SPDX-License-Identifier: BSD-3-Clause
// Ground that moves by a function of time: tables that are shaken and belts, beside closed forms,
// beside ground at rest seen from another frame, and beside forces of inertia.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <tuple>

#include "test/io/moving_robots.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

using test::Ball;
using test::Block;
using test::DifferentiateByAll;
using test::kGravity;
using test::kTwoPi;
using test::Make;
using test::RunOf;
using test::Text;
using test::Tight;

/// Of (z, clock, ż, rate of the clock, amplitude, frequency, phase, restitution).
using S = Dual<double, 8>;

/// A ball above a table at z = A sin(2π f t + φ), in closed form but for the instants, which are
/// bisected; a step of Newton's gives these their derivatives.
struct Bounces {
  std::array<S, 8> y;
  std::vector<double> times, impulses;

  static S Unknown(double guess, const S& value, double slope) { return S(guess) - value / slope; }

  S Table(const S& t) const {
    using std::sin;
    return y[4] * sin(kTwoPi * y[5] * t + y[6]);
  }
  S Speed(const S& t) const {  // by the clock
    using std::cos;
    return y[4] * kTwoPi * y[5] * cos(kTwoPi * y[5] * t + y[6]);
  }
  S Gap(const S& s) const {
    return y[0] + y[2] * s - 0.5 * kGravity * s * s - Table(y[1] + y[3] * s);
  }
  void Fly(const S& s) {
    y[0] += y[2] * s - 0.5 * kGravity * s * s;
    y[2] -= kGravity * s;
    y[1] += y[3] * s;
  }
  void Run(double duration) {
    S passed(0.0);
    while (true) {
      const double left = duration - passed.value;
      double low = 1e-6, high = low;  // a bounce is longer than that
      while (high < left && Gap(S(high)).value > 0) high += 1e-4;
      if (high >= left) break;
      low = high - 1e-4;
      for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (low + high);
        (Gap(S(middle)).value > 0 ? low : high) = middle;
      }
      const S at = y[1] + y[3] * low;
      const double slope = y[2].value - kGravity * low - (Speed(at) * y[3]).value;
      const S s = Unknown(low, Gap(S(low)), slope);
      passed += s;
      Fly(s);
      const S table = Speed(y[1]) * y[3], approach = y[2] - table;
      times.push_back(passed.value);
      impulses.push_back(-(1 + y[7].value) * approach.value);
      y[2] = table - y[7] * approach;
    }
    Fly(S(duration) - passed);
  }
};

std::string TableYaml(const std::string& more) {
  return "{constraints: {ball: {kind: plane, link: ball, restitution: 0.8, motion: {direction: [0, "
         "0, 2], amplitude: 0.02, frequency: 5, phase: 0.3}}}, parameters: {amplitude: "
         "ball/motion_amplitude, frequency: ball/motion_frequency, phase: ball/motion_phase, "
         "restitution: ball/restitution}, nominal: {positions: {z: 0.1, clock: 0.05}}" +
         more + "}";
}

/// Events, impulses, state and derivative of a ball that bounces on a table that shakes by 2 g.
/// Bounces multiply errors: by about 100 in these 1.3 s.
TEST(MovingGround, BallBouncesOnATableAsInClosedForm) {
  constexpr double kDuration = 1.3;
  Bounces expected;
  const double number[] = {0.1, 0.05, 0, 1, 0.02, 5, 0.3, 0.8};
  for (int k = 0; k < 8; ++k) expected.y[static_cast<std::size_t>(k)] = S::Variable(number[k], k);
  expected.Run(kDuration);
  ASSERT_GE(expected.times.size(), 3u);
  const RobotSystem system = Make(Ball(), TableYaml(""));
  const Trajectory run = RunOf(system, kDuration);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(expected.times.size(), run.transitions.size());
  for (std::size_t k = 0; k < expected.times.size(); ++k) {
    EXPECT_NEAR(expected.times[k], run.transitions[k].t, 1e-10);
    EXPECT_NEAR(expected.impulses[k], run.transitions[k].impulse(0), 1e-9);
    EXPECT_EQ(1, run.transitions[k].x_plus(3)) << "no impact changes the rate of time";
  }
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(expected.y[static_cast<std::size_t>(k)].value, run.FinalState()(k), 1e-9);
  }
  const BDerivative B = DifferentiateByAll(system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (int k = 0; k < 8; ++k) {
    const Vector column = B(Vector::Unit(8, k));
    for (int r = 0; r < 4; ++r) {
      const double exact = expected.y[static_cast<std::size_t>(r)].d[k];
      EXPECT_NEAR(exact, column(r), 1e-8 * (1 + std::abs(exact))) << r << ", " << k;
    }
  }
  EXPECT_LT(B.trust.energy, 1e-9) << "what the table gives is no gain";
}

/// What lies on a table that goes down by more than g lets go where r̈ = −g, and meets it again.
TEST(MovingGround, WhatRestsLetsGoWhereTheTableFallsAway) {
  const double amplitude = 0.05, frequency = 3, omega = kTwoPi * frequency;
  const RobotSystem system =
      Make(Ball(),
           "{constraints: {ball: {kind: plane, link: ball, motion: {direction: [0, 0, 1], "
           "amplitude: 0.05, frequency: 3}}}, nominal: {velocities: {z: " +
               Text(amplitude * omega) + "}}}");
  const Trajectory run = RunOf(system, 0.3);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.transitions.size());
  const double t = std::asin(kGravity / (amplitude * omega * omega)) / omega;
  EXPECT_NEAR(t, run.transitions[0].t, 1e-10);
  const double z = amplitude * std::sin(omega * t), v = amplitude * omega * std::cos(omega * t);
  const double s = run.transitions[1].t - t;
  EXPECT_NEAR(amplitude * std::sin(omega * (t + s)), z + v * s - 0.5 * kGravity * s * s, 1e-11);
  EXPECT_NEAR(amplitude * std::sin(omega * 0.3), run.FinalState()(0), 1e-10);
}

/// On a belt at speed w a block slips at μ g (of the 0.5 kg that press; 1 kg is moved) until it
/// moves along, from either side; then it sticks: x(T) = w T ∓ w²/(2 a) from rest.
TEST(MovingGround, ABeltCarriesABlock) {
  const double w = 1.5, mu = 0.4, a = mu * 0.5 * kGravity, T = 1.2;
  const std::string yaml =
      "{constraints: {block: {kind: plane, link: block, friction: 0.4, motion: {direction: [1, 0, "
      "0], velocity: 1.5}}}, parameters: {w: block/motion_velocity, mu: block/friction}";
  const RobotSystem system = Make(Block(), yaml + "}");
  const Trajectory run = RunOf(system, T);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_NEAR(w / a, run.transitions[0].t, 1e-11);
  EXPECT_NEAR(w * T - 0.5 * w * w / a, run.FinalState()(0), 1e-11);
  EXPECT_NEAR(w, run.FinalState()(3), 1e-11);
  EXPECT_EQ("s", run.arcs.back().mode.Word(1));
  const BDerivative B = DifferentiateByAll(system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  // (x, z, clock, ẋ, ż, rate, w, μ); the clock's rate multiplies w.
  const double by_w = T - w / a, by_mu = 0.5 * w * w / (a * mu), by_v = w / a;
  EXPECT_NEAR(by_w, B(Vector::Unit(8, 6))(0), 1e-9);
  EXPECT_NEAR(1, B(Vector::Unit(8, 6))(3), 1e-9);
  EXPECT_NEAR(by_mu, B(Vector::Unit(8, 7))(0), 1e-9);
  EXPECT_NEAR(by_v, B(Vector::Unit(8, 3))(0), 1e-9);
  EXPECT_NEAR(w * by_w, B(Vector::Unit(8, 5))(0), 1e-9);
  EXPECT_NEAR(0, B(Vector::Unit(8, 2)).head(2).norm(), 1e-12);
  const RobotSystem fast = Make(Block(), yaml + ", nominal: {velocities: {x: 2.5}}}");
  const Trajectory slowed = RunOf(fast, T);
  ASSERT_EQ(1u, slowed.transitions.size());
  EXPECT_NEAR(1 / a, slowed.transitions[0].t, 1e-11);
  EXPECT_NEAR(w * T + 0.5 / a, slowed.FinalState()(0), 1e-11);
}

/// On a plate at x = A sin ωt a block that moves along sticks while A ω² < μ g, and else slips from
/// the instant at which A ω² sin ωt = μ g until both speeds are one again.
TEST(MovingGround, AShakenPlateIsHeldOnToUpToItsThreshold) {
  const double A = 0.03, mu = 0.5, a = mu * 0.5 * kGravity;
  const auto make = [&](double frequency) {
    return Make(Block(),
                "{constraints: {block: {kind: plane, link: block, friction: 0.5, motion: "
                "{direction: [1, 0, 0], amplitude: 0.03, frequency: " +
                    Text(frequency) +
                    "}}}, nominal: {velocities: {x: " + Text(A * kTwoPi * frequency) +
                    "}}, parameters: {mu: block/friction, "
                    "f: block/motion_frequency}}");
  };
  const double threshold = std::sqrt(a / A) / kTwoPi;
  const Trajectory held = RunOf(make(0.999 * threshold), 3);
  ASSERT_TRUE(held.status.ok()) << held.status.message;
  EXPECT_TRUE(held.transitions.empty());
  const double frequency = 1.3 * threshold, omega = kTwoPi * frequency;
  const RobotSystem system = make(frequency);
  const Trajectory run = RunOf(system, 0.4);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_GE(run.transitions.size(), 2u);
  const double begin = std::asin(a / (A * omega * omega)) / omega;
  EXPECT_NEAR(begin, run.transitions[0].t, 1e-10);
  const auto faster = [&](double t) {  // than the plate
    return A * omega * (std::cos(omega * begin) - std::cos(omega * t)) - a * (t - begin);
  };
  double low = begin + 0.01, high = begin + 0.5 / frequency;
  ASSERT_GT(faster(low), 0);
  ASSERT_LT(faster(high), 0);
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (faster(middle) > 0 ? low : high) = middle;
  }
  EXPECT_NEAR(low, run.transitions[1].t, 1e-10);
}

/// Ground of every kind that moves evenly is ground at rest seen from another frame, also where it
/// is hit, slipped on and stuck to; so are the derivatives.
TEST(MovingGround, MovingEvenlyIsRestInAnotherFrame) {
  const Vec3<double> w(0.7, 0, -0.4);
  const char* const grounds[] = {
      "kind: plane, normal: [-0.2, 0, 1], restitution: 0.4, friction: 0.3",
      "kind: height_field, amplitude: 0.05, wave_x: 9, slope_x: 0.1, friction: 0.6",
      "kind: stairs, rise: 0.1, run: 0.3, riser: 0.1, first: 0.2, last: 2, restitution: 0.3",
      "kind: height_map, origin: [-1, -1], step: [0.3, 2], heights: [[0, 0.1, 0, 0.1, 0, 0.2, 0, "
      "0.1], [0, 0.1, 0, 0.1, 0, 0.2, 0, 0.1]], friction: 0.2"};
  for (const std::string ground : grounds) {
    const auto make = [&](bool moves) {
      return Make(
          Block(),
          "{constraints: {block: {link: block, " + ground +
              (moves ? ", motion: {direction: [0.7, 0, -0.4], velocity: " + Text(w.norm()) + "}"
                     : "") +
              "}}, nominal: {positions: {x: 0.1, z: 0.4}, velocities: {x: " +
              Text(1 + (moves ? w(0) : 0)) + ", z: " + Text(moves ? w(2) : 0) + "}}}");
    };
    const double T = 0.4;
    const RobotSystem moving = make(true), still = make(false);
    const Trajectory run = RunOf(moving, T), other = RunOf(still, T);
    ASSERT_TRUE(run.status.ok() && other.status.ok()) << ground << run.status.message;
    ASSERT_EQ(other.transitions.size(), run.transitions.size()) << ground;
    EXPECT_GE(run.transitions.size(), 1u);
    for (std::size_t k = 0; k < run.transitions.size(); ++k) {
      EXPECT_NEAR(other.transitions[k].t, run.transitions[k].t, 1e-9) << ground;
    }
    for (int k = 0; k < 2; ++k) {
      EXPECT_NEAR(other.FinalState()(k) + w(2 * k) * T, run.FinalState()(k), 1e-9) << ground;
      EXPECT_NEAR(other.FinalState()(2 + k) + w(2 * k), run.FinalState()(3 + k), 1e-9) << ground;
    }
    const BDerivative B = DifferentiateByAll(moving, run), C = DifferentiateByAll(still, other);
    ASSERT_EQ(B.status.ok(), C.status.ok()) << ground << B.status.message << C.status.message;
    if (!B.status.ok()) continue;
    const int velocity[] = {0, 1, 3, 4};
    for (int c = 0; c < 4; ++c) {
      const Vector ours = B(Vector::Unit(6, velocity[c])), its = C(Vector::Unit(4, c));
      for (int r = 0; r < 4; ++r) {
        EXPECT_NEAR(its(r), ours(velocity[r]), 1e-7 * (1 + its.norm())) << ground;
      }
    }
  }
}

/// A quadruped that is put down on a shaker and slips there, beside the same one on ground at rest
/// with the forces of inertia −m s̈ on its links, by splines of 400 pieces: right to h⁴ s⁗′/384 of
/// them, 1e-7. A slip begins once and does not end as it begins.
class Shaker : public testing::TestWithParam<std::tuple<Vec3<double>, double, double, double>> {};

TEST_P(Shaker, AQuadrupedFeelsForcesOfInertia) {
  const auto [along, amplitude, frequency, T] = GetParam();
  const Vec3<double> direction = along.normalized();
  const double omega = kTwoPi * frequency;
  const RobotTexts texts = ReadRobotTexts(RobotFile("quadruped_friction"));
  const YAML::Node plain = YAML::Load(texts.yaml);
  YAML::Node shaken = YAML::Clone(plain), pushed = YAML::Clone(plain);
  for (auto entry : shaken["constraints"]) {
    YAML::Node motion;
    for (int k = 0; k < 3; ++k) motion["direction"].push_back(Text(along(k)));
    motion["amplitude"] = Text(amplitude);
    motion["frequency"] = Text(frequency);
    entry.second["motion"] = motion;
  }
  const std::size_t count = 400;
  YAML::Node reference;
  reference["periodic"] = true;
  for (std::size_t k = 0; k <= count; ++k) {
    const double phase = k < count ? kTwoPi * static_cast<double>(k) / count : 0;
    reference["times"].push_back(Text(static_cast<double>(k) / count / frequency));
    reference["values"].push_back(Text(std::sin(phase)));
  }
  for (const RobotModel::Link& link : ParseRobot(texts).model.links) {
    if (link.inertia.mass == 0) continue;
    YAML::Node force;
    force["kind"] = "timed_force";
    force["link"] = link.name;
    for (int k = 0; k < 3; ++k) {
      force["point"].push_back(Text(link.inertia.com(k)));
      force["force"].push_back(Text(link.inertia.mass * amplitude * omega * omega * direction(k)));
    }
    force["reference"] = reference;
    pushed["efforts"]["inertia_" + link.name] = force;
  }
  const RobotSystem on_shaker(ParseRobot(texts.urdf, shaken, texts.folder), {});
  const RobotSystem with_forces(ParseRobot(texts.urdf, pushed, texts.folder), {});
  ASSERT_EQ(on_shaker.description().velocities, with_forces.description().velocities);
  const int nq = on_shaker.num_positions();
  const Vector x = with_forces.nominal().x;
  Vector start = x;  // ṡ at time zero
  start.segment(nq, 3) += amplitude * omega * direction;
  const Vector u = on_shaker.nominal().u;
  const Trajectory run = Simulate(on_shaker, start, u, T, Tight());
  const Trajectory other = Simulate(with_forces, x, u, T, Tight());
  ASSERT_TRUE(run.status.ok() && other.status.ok()) << run.status.message << other.status.message;
  const std::vector<Transition>&ours = run.transitions, &its = other.transitions;
  EXPECT_GE(ours.size(), 10u);
  ASSERT_EQ(its.size(), ours.size());
  Vector expected = other.FinalState();
  expected.head(3) += amplitude * std::sin(omega * T) * direction;
  expected.segment(nq, 3) += amplitude * omega * std::cos(omega * T) * direction;
  EXPECT_LT((expected - run.FinalState()).cwiseAbs().maxCoeff(), 1e-6);
  for (std::size_t k = 0; k < ours.size(); ++k) {
    EXPECT_NEAR(its[k].t, ours[k].t, 1e-7);
    EXPECT_EQ(its[k].mode_after, ours[k].mode_after);
    EXPECT_NE(ours[k].mode_before, ours[k].mode_after);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Directions, Shaker,
    testing::Values(std::make_tuple(Vec3<double>(0.6, 0.3, 0.4), 0.01, 6, 0.25),
                    std::make_tuple(Vec3<double>(0, 1, 0), 0.03, 6, 0.2),
                    std::make_tuple(Vec3<double>(0.3, 0.9, 0), 0.04, 4, 0.25)));

}  // namespace
}  // namespace contact_flow
