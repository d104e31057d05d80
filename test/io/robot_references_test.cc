// SPDX-License-Identifier: BSD-3-Clause
// Functions of time, and robots that follow them, against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "test/io/controlled_robots.h"

namespace contact_flow {
namespace {

using test::Cart;
using test::ExpectSlopeOne;
using test::Make;
using test::Tight;

TEST(TimeFunctions, SplinesAreSmoothAndPassTheirValues) {
  const std::vector<double> times = {0, 0.3, 0.5, 1.2, 2}, values = {1, -1, 0.5, 2, 1};
  for (const bool periodic : {false, true}) {
    const TimeFunction r(TimeFunction::Kind::kCubic, times, values, periodic);
    const auto at = [&](double t) {
      using S = Dual<double, 1>;
      S value, rate;
      r.At(S::Variable(t, 0), 0, &value, &rate);
      EXPECT_NEAR(value.d[0], rate.value, 1e-13);
      return Vec3<double>(value.value, rate.value, rate.d[0]);  // r, ṙ, r̈
    };
    for (std::size_t k = 0; k < times.size(); ++k) {
      EXPECT_NEAR(values[k], at(times[k])(0), 1e-14);
      const bool end = k == 0 || k + 1 == times.size();
      // 1e-9 s beside a knot r̈ has changed by 1e-9 times its rate, of order 1e2.
      const Vec3<double> jump = at(times[k] + 1e-9) - at(times[k] - 1e-9);
      EXPECT_LT(jump.head<2>().norm(), 1e-6);
      if (periodic || !end) {
        EXPECT_LT(std::abs(jump(2)), 1e-6);
      }
      if (!periodic && end) {
        EXPECT_NEAR(0, at(times[k])(1), 1e-14);
      }
    }
    if (periodic) {
      EXPECT_LT((at(0.77) - at(0.77 - 6)).norm(), 1e-12);
    } else {
      EXPECT_EQ(1, at(-3)(0));
      EXPECT_EQ(1, at(5)(0));
    }
  }
}

TEST(TimeFunctions, RefuseWhatIsNone) {
  using Kind = TimeFunction::Kind;
  EXPECT_THROW(TimeFunction(Kind::kCubic, {0, 1}, {0}, false), std::invalid_argument);
  EXPECT_THROW(TimeFunction(Kind::kCubic, {0}, {0}, false), std::invalid_argument);
  EXPECT_THROW(TimeFunction(Kind::kCubic, {0, 0}, {0, 1}, false), std::invalid_argument);
  EXPECT_THROW(TimeFunction(Kind::kCubic, {0, 1, 2, 3}, {0, 1, 2, 1}, true), std::invalid_argument);
  EXPECT_THROW(TimeFunction(Kind::kLinear, {0, 1, 2, 3}, {0, 1, 2, 0}, true),
               std::invalid_argument);
}

/// A cart held by k (r − x) + c (ṙ − ẋ): y = x − r swings as ÿ = −(k y + c ẏ)/m on each line of r,
/// and ẏ jumps by −Δṙ at its times. 2 ζ ω = c/m, ω² = k/m.
TEST(References, ALinearOneIsFollowedThroughItsSwitches) {
  const std::string yaml =
      "{efforts: {hold: {kind: track, joint: x, feed_forward: f, stiffness: 30, damping: 4, "
      "reference: {kind: linear, times: [0, 0.4, 0.7], values: [0, 0.2, -0.1]}}}, "
      "nominal: {positions: {x: 0.05}, inputs: {f: 0.7}}, parameters: {k: hold/stiffness, c: "
      "hold/damping}}";
  const RobotSystem system = Make(Cart(), yaml);
  ASSERT_EQ((std::vector<std::string>{"x", "clock"}), system.description().coordinates);
  const double m = 2, k = 30, c = 4, f = 0.7, duration = 1.1;
  const Trajectory run =
      Simulate(system, system.nominal().x, system.nominal().u, duration, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_EQ(2u, run.transitions.size());
  EXPECT_NEAR(0.4, run.transitions[0].t, 1e-14);
  const double times[] = {0, 0.4, 0.7, duration}, begin[] = {0, 0.2, -0.1}, slope[] = {0.5, -1, 0};
  double x = 0.05, v = 0;
  for (int i = 0; i < 3; ++i) {
    const double t = times[i + 1] - times[i], decay = c / (2 * m);
    const double omega = std::sqrt(k / m - decay * decay);
    const double y = x - begin[i] - f / k, w = v - slope[i];
    const double cosine = std::cos(omega * t), sine = std::sin(omega * t) / omega;
    const double e = std::exp(-decay * t);
    x = e * (y * cosine + (w + decay * y) * sine) + begin[i] + slope[i] * t + f / k;
    v = e * (w * cosine - (k / m * y + decay * w) * sine) + slope[i];
  }
  EXPECT_NEAR(x, run.FinalState()(0), 1e-11);
  EXPECT_NEAR(v, run.FinalState()(2), 1e-11);
  EXPECT_NEAR(duration, run.FinalState()(1), 1e-14);
  ExpectSlopeOne(Cart(), yaml, duration);
}

/// r = sin(2π t) by 64 pieces of a spline, off by 5/384 h⁴ r⁗ = 1.2e-6 at most. From the forced
/// motion of ẍ = (k (r − x) + c (ṙ − ẋ))/m itself, which is A sin + B cos, x stays there.
TEST(References, APeriodicOneForcesAnOscillation) {
  std::string times, values;
  for (int i = 0; i <= 64; ++i) {
    times += (i > 0 ? "," : "") + std::to_string(i / 64.0);
    values += (i > 0 ? "," : "") + std::to_string(i % 64 == 0 ? 0 : std::sin(i * M_PI / 32));
  }
  const std::string yaml =
      "{efforts: {hold: {kind: track, joint: x, feed_forward: f, stiffness: 30, damping: 4, "
      "reference: {periodic: true, times: [" +
      times + "], values: [" + values + "]}}}}";
  const RobotSystem system = Make(Cart(), yaml);
  const double m = 2, k = 30, c = 4, w = 2 * M_PI;
  // (k − m w² + i c w) X = k + i c w
  const double a = k - m * w * w, b = c * w, norm = a * a + b * b;
  const double real = (k * a + b * b) / norm, imaginary = (b * a - k * b) / norm;
  Vector x(4);
  x << imaginary, 0, w * real, 1;
  const double duration = 2.3;
  const Trajectory run = Simulate(system, x, system.nominal().u, duration, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_TRUE(run.transitions.empty());
  const double s = std::sin(w * duration), cosine = std::cos(w * duration);
  EXPECT_NEAR(real * s + imaginary * cosine, run.FinalState()(0), 2e-5);
  EXPECT_NEAR(w * (real * cosine - imaginary * s), run.FinalState()(2), 2e-4);
  ExpectSlopeOne(Cart(), yaml, 0.73);
}

/// The momentum of a pulse is its integral.
TEST(References, APushGivesItsMomentum) {
  const std::string yaml =
      "{efforts: {push: {kind: timed_force, link: cart, force: [10, 0, 3], reference: {times: "
      "[0.1, 0.2, 0.4], values: [0, 1, 0]}}}, parameters: {f: push/force_x}}";
  const RobotSystem system = Make(Cart(), yaml);
  const Trajectory run = Simulate(system, system.nominal().x, Vector(0), 0.6, Tight());
  // Clamped slopes are 0, m, 0 with m/0.1·2 + m/0.2·2 = 3 (1/0.01 − 1/0.04): m = 7.5. Each cubic
  // has the integral h (r₀ + r₁)/2 + h² (m₀ − m₁)/12.
  const double area = 0.1 / 2 - 0.01 * 7.5 / 12 + 0.2 / 2 + 0.04 * 7.5 / 12;
  EXPECT_NEAR(10 * area / 2, run.FinalState()(2), 1e-11);
  ExpectSlopeOne(Cart(), yaml, 0.33);
}

}  // namespace
}  // namespace contact_flow
