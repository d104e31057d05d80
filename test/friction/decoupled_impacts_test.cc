// SPDX-License-Identifier: BSD-3-Clause
// Impacts beside contacts of other bodies, which do not feel them. Two bodies with constant forces
// and inertias [m11 m12; m12 m22] of their own in (x, z), above one floor.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/systems/tips.h"

namespace contact_flow {
namespace {

struct Body {
  double m11, m12, m22, friction;
};

/// Free accelerations (a, −10) of both.
std::unique_ptr<MechanicalSystem> MakeBodies(const Body& first, const Body& second, double a) {
  ParameterValues values = {{"mu0", first.friction}, {"mu1", second.friction}};
  const auto set = [&](const Body& body, int k) {
    values["m" + std::to_string(5 * k)] = body.m11;
    values["m" + std::to_string(5 * k + 1)] = values["m" + std::to_string(5 * k + 4)] = body.m12;
    values["m" + std::to_string(5 * k + 5)] = body.m22;
    values["f" + std::to_string(k)] = body.m11 * a - 10 * body.m12;
    values["f" + std::to_string(k + 1)] = body.m12 * a - 10 * body.m22;
  };
  set(first, 0);
  set(second, 2);
  return MakeSystem<test::Pair>(values);
}

/// One body rests without slip, to rounding; the other lands. The rounding is no jam.
TEST(DecoupledImpacts, RoundingOfABodyAtRestIsNoJam) {
  const auto system = MakeBodies({2, 0.9, 1, -1}, {2, 0.9, 1, -1}, 0);
  Vector q = Vector::Zero(4), v(4);
  for (const double sign : {1.0, -1.0}) {
    v << sign * 4e-17, -sign * 3e-18, 0.3, -1;
    const FrictionalImpact impact = SolveFrictionalImpact(*system, q, v, {0, 1});
    EXPECT_EQ("os", impact.word.Word(2));
    EXPECT_EQ(v.head(2), impact.result.v_plus.head(2));
    EXPECT_LE(impact.result.v_plus.tail(2).cwiseAbs().maxCoeff(), 1e-15);
    // M (v⁺ − v⁻) = p
    EXPECT_NEAR(-(0.9 * 0.3 - 1), impact.result.impulse(1), 1e-14);
  }
}

/// What it has drifted while it rested is none either, if it is told of.
TEST(DecoupledImpacts, NorIsItsDrift) {
  const auto system = MakeBodies({2, 0.9, 1, -1}, {2, 0.9, 1, -1}, 0);
  Vector q = Vector::Zero(4), v(4);
  v << 4e-10, -3e-11, 0.3, -1;
  ContactMode before;
  before.Set(0, Letter::kStick);
  EXPECT_THROW(SolveFrictionalImpact(*system, q, v, {0, 1}), FrictionRefusal);
  EXPECT_EQ("os", SolveFrictionalImpact(*system, q, v, {0, 1}, before).word.Word(2));
}

/// Both land at once, stick by the impulse, and slip from there on, since a is more than friction
/// holds. After its own landing at t₁ a body moves by
///   ẍ = (f_x + μ f_z)/(m11 + μ m12),   x(T) = x(t₁) + ẍ (T − t₁)²/2,
/// whatever the other one does, so that in its height h, with ∂t₁/∂h = 1/|ż(t₁)|,
///   ∂ẋ(T)/∂h = −ẍ ∂t₁/∂h,   ∂x(T)/∂h = (ẋ(t₁⁻) − ẍ (T − t₁)) ∂t₁/∂h.
TEST(DecoupledImpacts, LandAtOnce) {
  const double a = 9, height = 0.05, duration = 0.4, down = 10;
  const double landing = std::sqrt(2 * height / down), speed = down * landing;
  for (int k = 0; k < 12; ++k) {
    const Body bodies[] = {{2.3 + 0.07 * k, 0.31 + 0.013 * k, 1.7 - 0.01 * k, 0.4},
                           {1.9 - 0.03 * k, 0.11 + 0.017 * k, 1.3 + 0.09 * k, 0.3}};
    const auto system = MakeBodies(bodies[0], bodies[1], a);
    Vector x = Vector::Zero(8);
    for (const int z : {1, 3}) x(z) = height;
    for (const int s : {4, 6}) x(s) = -a * landing;  // vertically down onto the floor
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-11;
    const Trajectory run = Simulate(*system, x, Vector::Zero(0), duration, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(1u, run.transitions.size());
    ASSERT_EQ("++", run.transitions[0].mode_after.Word(2));
    const BDerivative B = DifferentiateOutcome(*system, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    for (int body = 0; body < 2; ++body) {
      const Body& m = bodies[body];
      const double force = m.m11 * a - down * m.m12, normal = m.m12 * a - down * m.m22;
      const double slip = (force + m.friction * normal) / (m.m11 + m.friction * m.m12);
      Vector exact = Vector::Zero(8);
      exact(2 * body) = -slip * (duration - landing) / speed;
      exact(4 + 2 * body) = -slip / speed;
      for (const double sign : {1.0, -1.0}) {
        const Vector by = B(sign * Vector::Unit(8, 2 * body + 1));
        // Runs and tangents to 1e-9; entries up to 10.
        EXPECT_LE((by - sign * exact).cwiseAbs().maxCoeff(), 1e-7)
            << k << ", body " << body << ", " << sign << ": " << by.transpose() << " for "
            << sign * exact.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
