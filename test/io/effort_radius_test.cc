// SPDX-License-Identifier: BSD-3-Clause
// How far a derivative holds beside the limits of efforts: closed forms, and runs on either side.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/flow/corner_functions.h"
#include "test/io/moving_robots.h"

namespace contact_flow {
namespace {

using test::Ball;
using test::Make;
using test::Tight;

/// Whether the run from x + α w, w = (δq, δv, δu), passes a limit.
bool PassesLimit(const RobotSystem& system, double duration, double alpha, const Vector& w) {
  const Vector x = system.Perturb(system.nominal().x, alpha * w.head(2));
  const Vector u = system.nominal().u + alpha * w.tail(w.size() - 2);
  for (const Arc& arc : Simulate(system, x, u, duration, Tight()).arcs) {
    if (!LimitPassings(system, arc).empty()) return true;
  }
  Vector share;  // or it is beyond one all along
  system.EffortShares(x.head(1), x.tail(1), u, ContactMode(), &share);
  return share.cwiseAbs().maxCoeff() > 1;
}

void ExpectRadius(const RobotSystem& system, double duration, const Vector& w, double radius) {
  const Trajectory run =
      Simulate(system, system.nominal().x, system.nominal().u, duration, Tight());
  BDerivativeOptions options;
  options.variables.inputs = true;
  const BDerivative B = DifferentiateOutcome(system, run, options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const ValidityRadius found = ValidityEstimator(system, run, B)(w);
  EXPECT_NEAR(radius, found.radius, 1e-6 * radius) << w.transpose();
  EXPECT_EQ(ValidityRadius::Limit::kEffort, found.limit) << w.transpose();
  const std::string text = Describe(system.description(), found);
  EXPECT_EQ(0u, text.find("the effort 'a' reaches its limit")) << text;
  EXPECT_TRUE(PassesLimit(system, duration, 1.001 * radius, w)) << w.transpose();
  EXPECT_FALSE(PassesLimit(system, duration, 0.999 * radius, w)) << w.transpose();
}

/// A constant input of 0.2 N beside limits of ±0.3 N.
TEST(RadiusOfEfforts, OfAConstantInput) {
  const RobotSystem ball = Make(
      Ball(),
      "{base: fixed, gravity: 0, efforts: {a: {kind: actuator, joint: z, input: u, limit: 0.3}}, "
      "nominal: {inputs: {u: 0.2}}}");
  ExpectRadius(ball, 1, Vector::Unit(3, 2), 0.1);
  ExpectRadius(ball, 1, -Vector::Unit(3, 2), 0.5);
}

/// A spring of 20 N/m by a servo whose limit is that of 0.4 m: a swing of v/ω = 0.3 m turns at
/// ω t = π/2, inside the run.
TEST(RadiusOfEfforts, OfATurn) {
  const double omega = std::sqrt(20);
  const RobotSystem ball =
      Make(Ball(),
           "{base: fixed, gravity: 0, efforts: {a: {kind: servo, joint: z, input: u, "
           "stiffness: 20, limit: 8}}, nominal: {velocities: {z: " +
               test::Text(0.3 * omega) + "}}}");
  ExpectRadius(ball, 0.5, Vector::Unit(3, 1), 0.1 * omega);
  ExpectRadius(ball, 0.5, -Vector::Unit(3, 1), 0.7 * omega);
}

/// What is beyond its limit from the start to the end comes back in.
TEST(RadiusOfEfforts, BeyondTheLimit) {
  const RobotSystem ball = Make(
      Ball(),
      "{base: fixed, gravity: 0, efforts: {a: {kind: actuator, joint: z, input: u, limit: 0.3}}, "
      "nominal: {inputs: {u: 0.5}}}");
  const Trajectory run = Simulate(ball, ball.nominal().x, ball.nominal().u, 1, Tight());
  BDerivativeOptions options;
  options.variables.inputs = true;
  const BDerivative B = DifferentiateOutcome(ball, run, options);
  const ValidityEstimator radius(ball, run, B);
  EXPECT_NEAR(0.2, radius(-Vector::Unit(3, 2)).radius, 1e-7);
  EXPECT_TRUE(std::isinf(radius(Vector::Unit(3, 2)).radius));
  EXPECT_TRUE(std::isinf(radius(Vector::Unit(3, 0)).radius));
}

/// A run of no duration has what is at its start alone.
TEST(RadiusOfEfforts, OfNoDuration) {
  const RobotSystem ball = Make(
      Ball(),
      "{base: fixed, gravity: 0, efforts: {a: {kind: servo, joint: z, input: u, stiffness: 20, "
      "limit: 8}}, nominal: {positions: {z: 0.3}}}");
  const Trajectory run = Simulate(ball, ball.nominal().x, ball.nominal().u, 0, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const BDerivative B = DifferentiateOutcome(ball, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_NEAR(0.1, ValidityEstimator(ball, run, B)(Vector::Unit(2, 0)).radius, 1e-7);
}

}  // namespace
}  // namespace contact_flow
