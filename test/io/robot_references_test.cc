// SPDX-License-Identifier: BSD-3-Clause
// Functions of time, and robots that follow them, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
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

/// Blends of 0.2 s: r is the integral of a rate that is straight between its corners.
TEST(TimeFunctions, BlendedOnesLeadTheirRateFromLineToLine) {
  const std::vector<double> times = {0, 0.5, 0.9, 2}, values = {1, -1, 0.5, 1};
  const double b = 0.2;
  for (const bool periodic : {false, true}) {
    const TimeFunction r(TimeFunction::Kind::kBlended, times, values, periodic, b);
    const double less = periodic ? 0 : b / 2;  // what the first and the last line start and end by
    const double m0 = -2 / (0.5 - less), m1 = 1.5 / 0.4, m2 = 0.5 / (1.1 - less);
    std::vector<Eigen::Vector2d> corners = {{0, 0},    {0.2, m0}, {0.4, m0}, {0.6, m1},
                                            {0.8, m1}, {1, m2},   {1.8, m2}, {2, 0}};
    if (periodic) {
      corners[0](1) = corners[7](1) = (m2 + m0) / 2;
      corners[1](0) = 0.1;
      corners[6](0) = 1.9;
    }
    double reached = periodic ? 1 + (m0 - m2) * b / 8 : 1;
    for (std::size_t k = 0; k + 1 < corners.size(); ++k) {
      const double length = corners[k + 1](0) - corners[k](0);
      const double rise = corners[k + 1](1) - corners[k](1);
      for (const double part : {1e-6, 0.3, 0.999}) {
        using S = Dual<double, 1>;
        for (const double lap : {0.0, periodic ? 6.0 : 0.0}) {
          S value, rate;
          r.At(S::Variable(corners[k](0) + part * length + lap, 0), 0, &value, &rate);
          const double expected =
              reached + length * (part * corners[k](1) + part * part / 2 * rise);
          EXPECT_NEAR(expected, value.value, 1e-13) << k << ' ' << part;
          EXPECT_NEAR(corners[k](1) + part * rise, rate.value, 1e-12);
          EXPECT_NEAR(rate.value, value.d[0], 1e-13);
          EXPECT_NEAR(rise / length, rate.d[0], 1e-11);
        }
      }
      EXPECT_NEAR(corners[k + 1](0), r.NextKnot(corners[k](0) + 0.3 * length), 1e-15);
      reached += length * (corners[k](1) + rise / 2);
    }
    EXPECT_TRUE(r.Switches().empty());
    double value = 0, rate = 0;
    r.At(5.0, 0, &value, &rate);
    if (!periodic) EXPECT_EQ(1, value);
  }
}

/// Where blends fill the time between two knots, which 0.1 s are not exactly, lines have no length.
TEST(TimeFunctions, BlendedOnesMayHaveNoLines) {
  const std::vector<double> times = {0.1, 0.2, 0.3, 0.4, 0.5}, values = {0, 1, -1, 2, 0};
  const TimeFunction r(TimeFunction::Kind::kBlended, times, values, true, 0.1);
  double last = 0.1;
  for (double t = r.NextKnot(0.1); t < 0.5; last = t, t = r.NextKnot(t)) {
    EXPECT_GE(t, last);
    for (const double at : {t - 1e-9, t, t + 1e-9}) {
      const auto nearest = std::min_element(times.begin(), times.end(), [&](double a, double b) {
        return std::abs(a - at) < std::abs(b - at);
      });
      const std::size_t k = static_cast<std::size_t>(nearest - times.begin()) % 4;
      const double before = (values[k] - values[(k + 3) % 4]) / 0.1;
      const double behind = (values[k + 1] - values[k]) / 0.1, s = at - *nearest;
      double value = 0, rate = 0;
      r.At(at, 0, &value, &rate);
      // r = r_k + Δṙ b/8 + ṙ s + Δṙ s²/(2 b) about each time.
      const double expected = values[k] + (behind - before) * 0.0125 + (before + behind) / 2 * s +
                              (behind - before) * s * s / 0.2;
      EXPECT_NEAR(expected, value, 1e-12) << at;
      EXPECT_NEAR((before + behind) / 2 + (behind - before) * s / 0.1, rate, 1e-6) << at;
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
  for (const double blend : {0.0, -1.0, 0.7, std::nan("")}) {  // at the ends 1.5 b have to fit
    EXPECT_THROW(TimeFunction(Kind::kBlended, {0, 1, 2}, {0, 1, 0}, false, blend),
                 std::invalid_argument);
  }
}

/// What holds the cart below, by a reference of this kind.
std::string HeldCart(const std::string& kind) {
  return "{efforts: {hold: {kind: track, joint: x, feed_forward: f, stiffness: 30, damping: 4, "
         "reference: {" +
         kind +
         ", times: [0, 0.4, 0.7], values: [0, 0.2, -0.1]}}}, nominal: {positions: {x: 0.05}, "
         "inputs: {f: 0.7}}, parameters: {k: hold/stiffness, c: hold/damping}}";
}

/// A cart held by k (r − x) + c (ṙ − ẋ): y = x − r swings as ÿ = −(k y + c ẏ)/m on each line of r,
/// and ẏ jumps by −Δṙ at its times. 2 ζ ω = c/m, ω² = k/m.
TEST(References, ALinearOneIsFollowedThroughItsSwitches) {
  const std::string yaml = HeldCart("kind: linear");
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

/// The same led through blends of 0.1 s, where ÿ = −(k y + c ẏ)/m − r̈: no events.
TEST(References, ABlendedOneIsFollowedThroughItsCorners) {
  const std::string yaml = HeldCart("kind: blended, blend: 0.1");
  const RobotSystem system = Make(Cart(), yaml);
  const double m = 2, k = 30, c = 4, f = 0.7, duration = 1.1, b = 0.1;
  const Trajectory run =
      Simulate(system, system.nominal().x, system.nominal().u, duration, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_TRUE(run.transitions.empty());
  const double first = 0.2 / 0.35, second = -0.3 / 0.25;
  const struct {
    double length, bend;  // r̈
  } pieces[] = {{b, first / b}, {0.25, 0},        {b, (second - first) / b},
                {0.15, 0},      {b, -second / b}, {0.4, 0}};
  double y = 0.05, w = 0;
  for (const auto& piece : pieces) {
    const double t = piece.length, decay = c / (2 * m), omega = std::sqrt(k / m - decay * decay);
    const double rest = (f - m * piece.bend) / k;
    const double cosine = std::cos(omega * t), sine = std::sin(omega * t) / omega;
    const double e = std::exp(-decay * t), from = y - rest;
    y = e * (from * cosine + (w + decay * from) * sine) + rest;
    w = e * (w * cosine - (k / m * from + decay * w) * sine);
  }
  EXPECT_NEAR(y - 0.1, run.FinalState()(0), 1e-11);
  EXPECT_NEAR(w, run.FinalState()(2), 1e-11);
  ExpectSlopeOne(Cart(), yaml, 0.66);
}

/// A block that is pushed by 20 r(t) slips from where r = μ m g / 20 on, on the line that leads to
/// r(0.5) = 1 with the slope 1/0.45. A rate that jumps is not offered beside friction.
TEST(References, BlendedOnesGoWithFriction) {
  const std::string block = "<robot name=\"r\">" + test::Link("block", "2") + "</robot>";
  const auto push = [](const std::string& kind) {
    return "{base: planar, constraints: {foot: {kind: plane, link: block, friction: 0.5}}, "
           "efforts: {push: {kind: timed_force, link: block, force: [20, 0, 0], reference: {" +
           kind + ", times: [0, 0.5, 1], values: [0, 1, 0]}}}}";
  };
  const RobotSystem system = Make(block, push("kind: blended, blend: 0.1"));
  const Trajectory run = Simulate(system, system.nominal().x, system.nominal().u, 0.35, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_NEAR(0.5 + 0.45 * (0.5 * 2 * 9.81 / 20 - 1), run.transitions[0].t, 1e-10);
  EXPECT_EQ("+", run.arcs[1].mode.Word(1));
  const std::string refusal = test::Refusal(block, push("kind: linear"));
  for (const char* words : {"efforts/push", "linear", "'foot'", "kind: blended", "line 1"}) {
    EXPECT_NE(std::string::npos, refusal.find(words)) << refusal;
  }
  EXPECT_NE(std::string::npos, test::Refusal(block, push("kind: blended")).find("blend"));
  const std::string alone = test::Refusal(block, push("kind: cubic, blend: 0.1"));
  EXPECT_NE(std::string::npos, alone.find("reference/blend")) << alone;
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
