// SPDX-License-Identifier: BSD-3-Clause
// Actuators whose effort falls with the speed of their joint: where they pass its line, and the
// derivative through that, beside closed forms.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "test/io/limited_drives.h"

namespace contact_flow {
namespace {

using test::Arm;
using test::Cart;
using test::ExpectDerivative;
using test::ExpectPassings;
using test::ExpectSlopeOne;
using test::Link;
using test::Make;
using test::QuotientsOf;
using test::Real;
using test::RealState;
using test::Refusal;
using test::Robot;
using test::Tight;

const char kEffort[] =
    "s_x: {kind: servo, joint: x, input: u, stiffness: 20, limit: 8, speed: 2, stall: 10}";
const char kParameters[] =
    "parameters: {limit: s_x/limit, speed: s_x/speed, stall: s_x/stall, k: s_x/stiffness}";

std::string Yaml(const std::string& effort, const std::string& more) {
  return "{efforts: {" + effort + "}, " + more + "}";
}

/// 2 kg under the force k (1 − x), at most `limit`, and at most stall (1 − v/speed). From rest at 0
/// it is limited, then on the line, then free.
struct Motor {
  static constexpr double kDuration = 1;  // of what is compared
  Real x = 0, v = 0, limit = 8, speed = 2, stall = 10, k = 20, mass = 2;

  /// (x, v) after `duration`; the instants of both passings into `passed`, if given.
  RealState Run(Real duration, std::array<Real, 2>* passed = nullptr) const {
    // limit = stall (1 − v/speed)
    const Real fast = speed * (1 - limit / stall), push = limit / mass;
    const Real first = (fast - v) / push, at = x + v * first + 0.5L * push * first * first;
    // v̇ = (stall/mass) (1 − v/speed)
    const Real tau = mass * speed / stall;
    const auto on_line = [&](Real t) -> RealState {
      const Real fade = std::exp(-t / tau);
      return {at + speed * t + (fast - speed) * tau * (1 - fade), speed + (fast - speed) * fade};
    };
    Real low = 0, high = duration;  // k (1 − x) = stall (1 − v/speed), bisected
    for (int i = 0; i < 200; ++i) {
      const Real middle = 0.5L * (low + high);
      const auto [y, w] = on_line(middle);
      (k * (1 - y) > stall * (1 - w / speed) ? low : high) = middle;
    }
    const auto [y, w] = on_line(low);
    const Real omega = std::sqrt(k / mass), t = duration - first - low;
    const Real c = std::cos(omega * t), s = std::sin(omega * t);
    if (passed != nullptr) *passed = {first, first + low};
    return {1 + (y - 1) * c + w / omega * s, (1 - y) * omega * s + w * c};
  }
};

TEST(SpeedLimits, ArePassedWhereTheClosedFormSays) {
  std::array<Real, 2> instants;
  const RealState end = Motor().Run(Motor::kDuration, &instants);
  const RobotSystem system = Make(Cart(), Yaml(kEffort, "nominal: {inputs: {u: 1}}"));
  ASSERT_EQ((std::vector<std::string>{"s_x", "s_x/speed"}), system.limited_efforts());
  const auto t = [&](int k) { return static_cast<double>(instants[k]); };
  ExpectPassings(system, Motor::kDuration, end,
                 {{t(0), 0, EffortPiece::kUpper, EffortPiece::kFree},
                  {t(0), 1, EffortPiece::kFree, EffortPiece::kUpper},
                  {t(1), 1, EffortPiece::kUpper, EffortPiece::kFree}});
}

/// By x, v, limit, speed, stall and stiffness, beside central quotients of the closed form.
TEST(SpeedLimits, HaveTheDerivativeOfTheClosedForm) {
  const std::string yaml = Yaml(kEffort, std::string("nominal: {inputs: {u: 1}}, ") + kParameters);
  const RobotSystem system = Make(Cart(), yaml);
  const Matrix expected = QuotientsOf(6, [](int c, Real h) {
    Motor motor;
    Real* const number[] = {&motor.x, &motor.v, &motor.limit, &motor.speed, &motor.stall, &motor.k};
    *number[c] += h;
    return motor.Run(Motor::kDuration);
  });
  BDerivativeOptions options;
  options.tolerance = 1e-12;
  options.variables.parameters =
      ParameterIndices(system.description(), {"limit", "speed", "stall", "k"});
  ExpectDerivative(system, Motor::kDuration, expected, options);
  ExpectSlopeOne(Cart(), yaml, Motor::kDuration);
}

/// Without `stall` the line falls from the limit; faster than `speed` the motor brakes along it:
/// v = c + (v₀ − c) e^(−t/τ), τ = m c/limit.
TEST(SpeedLimits, BrakeBeyondTheSpeed) {
  const RobotSystem system =
      Make(Cart(), "{efforts: {s: {kind: actuator, joint: x, input: u, limit: 10, speed: 2}}}");
  Vector x(2);
  x << 0, 3;
  const Trajectory run = Simulate(system, x, system.nominal().u, 0.7, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_NEAR(2 + std::exp(-0.7 / 0.4), run.FinalState()(1), 1e-11);
  EXPECT_NEAR(1.4 + 0.4 * (1 - std::exp(-0.7 / 0.4)), run.FinalState()(0), 1e-11);
  // So fast that the line asks for more than the limit, it brakes with the limit.
  x(1) = 7;
  EXPECT_NEAR(-10, system.JointEfforts(x.head(1), x.tail(1), system.nominal().u, {})(0), 1e-14);
  x(1) = -1;  // driven backward: −10 (1 − 1/2) is the other line
  Vector u(1);
  u << -9;
  EXPECT_NEAR(-5, system.JointEfforts(x.head(1), x.tail(1), u, {})(0), 1e-14);
  u << 9;  // against the motion: the limit alone
  EXPECT_NEAR(9, system.JointEfforts(x.head(1), x.tail(1), u, {})(0), 1e-14);
}

/// Two rods whose drives pass limit and line at different instants, with damping and weight.
TEST(SpeedLimits, OfAnArm) {
  ExpectSlopeOne(
      Arm(),
      "{efforts: {a: {kind: pd, joint: shoulder, position: p, velocity: w, feed_forward: f, "
      "stiffness: 60, damping: 1, limit: 12, speed: 4, stall: 15}, b: {kind: servo, joint: elbow, "
      "input: q, stiffness: 40, limit: 5, speed: 3}}, nominal: {inputs: {p: 1, q: -0.8}}, "
      "parameters: {speed: [a/speed], limit: b/limit, stall: a/stall}}",
      0.35);
}

TEST(SpeedLimits, OfTheUrdf) {
  const std::string servo = "{efforts: {s: {kind: servo, joint: x, input: u, stiffness: 1, ";
  const RobotSystem system =
      Make(Cart(), servo + "limit: urdf, speed: urdf}}, parameters: {l: s/limit, v: s/speed}}");
  EXPECT_EQ(1, system.description().parameters[0].value);
  EXPECT_EQ(1, system.description().parameters[1].value);
  const struct {
    std::string end, words;
  } refusals[] = {
      {"speed: 2}}}", "efforts/s/speed needs the effort at standstill"},
      {"limit: 3, stall: 4}}}", "efforts/s/stall bounds an effort that falls with speed"},
      {"limit: max}}}", "limit is 'max', expected a number"},
      {"speed: -1, limit: 2}}}", "speed"},
  };
  for (const auto& [end, words] : refusals) {
    EXPECT_NE(std::string::npos, Refusal(Cart(), servo + end).find(words))
        << Refusal(Cart(), servo + end);
  }
  const std::string lazy =
      Robot(Link("cart", "2") +
            "<joint name=\"x\" type=\"prismatic\"><parent link=\"world\"/><child link=\"cart\"/>"
            "<axis xyz=\"1 0 0\"/><limit lower=\"-1\" upper=\"1\" effort=\"0\" velocity=\"2\"/>"
            "</joint>");
  EXPECT_NE(std::string::npos, Refusal(lazy, servo + "limit: urdf}}}")
                                   .find("limit: the URDF gives joint 'x' no largest effort"));
}

}  // namespace
}  // namespace contact_flow
