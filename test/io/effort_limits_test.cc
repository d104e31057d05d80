// SPDX-License-Identifier: BSD-3-Clause
// Actuators that saturate: steps end where an effort passes its limit, and the derivative is that
// of closed forms on both sides of it.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>

#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "test/io/limited_drives.h"

namespace contact_flow {
namespace {

using test::ByBothMethods;
using test::Cart;
using test::ExpectDerivative;
using test::ExpectPassings;
using test::ExpectSlopeOne;
using test::Joint;
using test::Link;
using test::Make;
using test::QuotientsOf;
using test::Real;
using test::RealState;
using test::Robot;
using test::Tight;

/// 2 kg under the force k (1 − x), at most `limit` either way, from (x, v).
struct Servo {
  static constexpr double kDuration = 2.6;  // of what is compared
  Real k = 20, limit = 8, mass = 2;

  /// (x, v) after `duration`, piece by piece; the instants of passing into `passed`, if given.
  RealState Run(Real x, Real v, Real duration, std::vector<Real>* passed = nullptr) const {
    const Real reach = limit / k, omega = std::sqrt(k / mass), push = limit / mass;
    Real t = 0;
    int piece = 1 - x > reach ? 1 : x - 1 > reach ? -1 : 0;
    while (true) {
      Real end = duration - t;
      int next = piece;
      if (piece != 0) {  // x + v s + piece push s²/2 = 1 − piece reach
        const Real a = 0.5L * piece * push, b = v, c = x - (1 - piece * reach);
        const Real root = std::sqrt(b * b - 4 * a * c);
        const Real s = (-b + piece * root) / (2 * a);
        if (s < end) {
          end = s;
          next = 0;
        }
        x += v * end + a * end * end;
        v += 2 * a * end;
      } else {  // y = x − 1 = A cos(ω s − φ) reaches ± reach, going outward
        const Real amplitude = std::hypot(x - 1, v / omega);
        const Real phase = std::atan2(v / omega, x - 1);
        if (amplitude > reach) {
          const Real pi = std::acos(Real(-1)), angle = std::acos(reach / amplitude);
          for (const int side : {1, -1}) {  // ω s = φ − angle, or φ + π − angle
            Real turn = std::fmod(phase - angle + (side < 0 ? pi : 0), 2 * pi);
            if (turn <= 1e-15L) turn += 2 * pi;
            if (turn / omega < end) {
              end = turn / omega;
              next = -side;
            }
          }
        }
        const Real y = x - 1, c = std::cos(omega * end), s = std::sin(omega * end);
        x = 1 + y * c + v / omega * s;
        v = -y * omega * s + v * c;
      }
      t += end;
      if (next == piece) return {x, v};
      if (passed != nullptr) passed->push_back(t);
      piece = next;
    }
  }
};

std::string ServoOn(const std::string& joint) {
  return "s_" + joint + ": {kind: servo, joint: " + joint + ", input: u, stiffness: 20, limit: 8}";
}
std::string ServoYaml() {
  return "{efforts: {" + ServoOn("x") +
         "}, nominal: {inputs: {u: 1}}, parameters: {limit: s_x/limit, k: s_x/stiffness}}";
}

/// d(x, v)/d(x, v, limit, k) of the closed form.
Matrix ServoDerivative() {
  return QuotientsOf(4, [](int c, Real h) {
    Servo servo;
    Real x = 0, v = 0;
    (c == 0 ? x : c == 1 ? v : c == 2 ? servo.limit : servo.k) += h;
    return servo.Run(x, v, Servo::kDuration);
  });
}

BDerivativeOptions ByAll() {
  BDerivativeOptions options;
  options.tolerance = 1e-12;
  options.variables.parameters = {0, 1};
  return options;
}

TEST(EffortLimits, ArePassedWhereTheClosedFormSays) {
  std::vector<Real> instants;
  const RealState end = Servo().Run(0, 0, Servo::kDuration, &instants);
  ASSERT_EQ(4u, instants.size());
  const RobotSystem system = Make(Cart(), ServoYaml());
  ASSERT_EQ(std::vector<std::string>{"s_x"}, system.limited_efforts());
  const std::array<EffortPiece, 5> pieces = {EffortPiece::kUpper, EffortPiece::kFree,
                                             EffortPiece::kLower, EffortPiece::kFree,
                                             EffortPiece::kUpper};
  std::vector<LimitPassing> expected;
  for (std::size_t k = 0; k < 4; ++k) {
    expected.push_back({static_cast<double>(instants[k]), 0, pieces[k], pieces[k + 1]});
  }
  ExpectPassings(system, Servo::kDuration, end, expected);
}

/// Steps do not contain the corner: loose tolerances give what smooth motion has, and take as many.
TEST(EffortLimits, CostNoAccuracyAndFewSteps) {
  const RobotSystem system = Make(Cart(), ServoYaml());
  const auto end = Servo().Run(0, 0, Servo::kDuration);
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-7;
  const Trajectory run =
      Simulate(system, system.nominal().x, system.nominal().u, Servo::kDuration, options);
  ASSERT_TRUE(run.status.ok());
  EXPECT_NEAR(static_cast<double>(end[0]), run.FinalState()(0), 1e-8);
  EXPECT_LT(run.statistics.steps, 25);
  EXPECT_LT(run.statistics.rejected_steps, 6);
}

TEST(EffortLimits, HaveTheDerivativeOfTheClosedForm) {
  const RobotSystem system = Make(Cart(), ServoYaml());
  const Matrix expected = ServoDerivative();
  ExpectDerivative(system, Servo::kDuration, expected, ByAll());
  // Backward, by one covector.
  ByBothMethods([&](const SimulateOptions& simulate) {
    const Trajectory run =
        Simulate(system, system.nominal().x, system.nominal().u, Servo::kDuration, simulate);
    RunCost cost;
    cost.terminal = [](const Vector& x, Vector* by_state) {
      *by_state = Vector::Unit(2, 0);
      return x(0);
    };
    const CostGradient J = DifferentiateCost(system, run, cost, ByAll());
    ASSERT_TRUE(J.status.ok()) << J.status.message;
    EXPECT_LT((J.initial.transpose() - expected.row(0).head(2)).norm(), 1e-10);
    EXPECT_LT((J.parameters.transpose() - expected.row(0).tail(2)).norm(), 1e-10);
  });
  ExpectSlopeOne(Cart(), ServoYaml(), Servo::kDuration);
}

/// Two joints that pass at the same instants: the corners are two breaks at one instant.
TEST(EffortLimits, PassAtOnce) {
  const std::string two =
      Robot(Link("cart", "2") + Joint("x", "prismatic", "world", "cart", "1 0 0") +
            Link("other", "2") + Joint("y", "prismatic", "world", "other", "0 1 0"));
  const RobotSystem system = Make(
      two, "{efforts: {" + ServoOn("x") + ", " + ServoOn("y") + "}, nominal: {inputs: {u: 1}}}");
  const Trajectory run =
      Simulate(system, system.nominal().x, system.nominal().u, Servo::kDuration, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_EQ(8u, LimitPassings(system, run.arcs[0]).size());
  BDerivativeOptions options;
  options.tolerance = 1e-12;
  const BDerivative B = DifferentiateOutcome(system, run, options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const Matrix expected = ServoDerivative();
  for (int c = 0; c < 4; ++c) {
    const Vector column = B(Vector::Unit(4, c));
    for (int r = 0; r < 4; ++r) {
      EXPECT_NEAR(r % 2 == c % 2 ? expected(r / 2, c / 2) : 0, column(r), 1e-10) << r << ' ' << c;
    }
  }
}

/// Outward at the speed with which the swing just reaches the limit: it is touched, not passed.
TEST(EffortLimits, MayBeTouched) {
  const RobotSystem system = Make(Cart(), ServoYaml());
  Vector x(2);
  x << 1, 0.4 * std::sqrt(10.0);
  const double turn = 0.5 * std::acos(-1.0) / std::sqrt(10.0);
  const Trajectory run = Simulate(system, x, system.nominal().u, 2 * turn, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_NEAR(1, run.FinalState()(0), 1e-11);
  const BDerivative B = DifferentiateOutcome(system, run, ByAll());
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (int c = 0; c < 2; ++c) {  // half a turn: −I
    EXPECT_LT((B(Vector::Unit(4, c)).head(2) + Vector::Unit(2, c)).norm(), 1e-10) << c;
  }
}

/// A stop that is met where the servo leaves its limit: one event, whose map knows of no corner.
TEST(EffortLimits, PassWhereAContactIsMade) {
  const std::string yaml =
      "{efforts: {" + ServoOn("x") +
      "}, nominal: {inputs: {u: 1}}, constraints: {stop: {kind: upper_limit, joint: x, upper: 0.6, "
      "restitution: 0.5}}}";
  ExpectSlopeOne(Cart(), yaml, 0.8);
}

/// Along with a clock: the derivative from a mark to now is that of the whole run.
TEST(EffortLimits, PassUnderTheRollingDerivative) {
  const auto system =
      std::make_shared<RobotSystem>(ParseRobot(Cart(), YAML::Load(ServoYaml())), ParameterValues());
  OnlineFlow flow(system, 0, system->nominal().x, system->nominal().u, Tight());
  BDerivativeOptions options;
  options.tolerance = 1e-12;
  RollingDerivative rolling(&flow, Matrix::Identity(2, 2), options, Tight());
  for (int k = 1; k <= 190; ++k) {
    const bool passed = flow.AdvanceTo(Servo::kDuration * k / 190);
    rolling.Follow(&flow, passed);
  }
  const RollingDerivative::Reading reading = rolling.Read(&flow);
  ASSERT_TRUE(reading.status.ok()) << reading.status.message;
  EXPECT_LT((reading.tangents - ServoDerivative().leftCols(2)).norm(), 1e-9);
}

}  // namespace
}  // namespace contact_flow
