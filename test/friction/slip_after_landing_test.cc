// SPDX-License-Identifier: BSD-3-Clause
// A mass on springs lands so steeply that it sticks, and so lightly that friction does not hold it
// there: it begins to slip at once, in a direction that depends on where it has landed.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/systems/tip.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kGravity;

constexpr double kLandedFriction = 0.5, kSpringRestY = 0.6, kLandedDuration = 0.7;
constexpr double kSpringX = 9, kSpringY = 14, kSpringRestX = 0.5;

using Glide = std::array<double, 4>;  // x, y and their rates

Glide BesideGlide(const Glide& y, const Glide& slope, double h) {
  Glide z = y;
  for (std::size_t i = 0; i < 4; ++i) z[i] += h * slope[i];
  return z;
}

/// Springs, and friction μ g against the slip; of none, against the pull.
Glide GlideField(const Glide& y, double friction) {
  const double pull_x = kSpringX * (kSpringRestX - y[0]), pull_y = kSpringY * (kSpringRestY - y[1]);
  const double slip = std::hypot(y[2], y[3]), pull = std::hypot(pull_x, pull_y);
  const double along_x = slip > 0 ? y[2] / slip : pull_x / pull;
  const double along_y = slip > 0 ? y[3] / slip : pull_y / pull;
  return {y[2], y[3], pull_x - friction * along_x, pull_y - friction * along_y};
}

Glide GlideOn(Glide y, double duration, double friction) {
  constexpr int kSteps = 4000;
  const double h = duration / kSteps;
  for (int k = 0; k < kSteps; ++k) {
    const Glide a = GlideField(y, friction), b = GlideField(BesideGlide(y, a, h / 2), friction);
    const Glide c = GlideField(BesideGlide(y, b, h / 2), friction),
                d = GlideField(BesideGlide(y, c, h), friction);
    for (std::size_t i = 0; i < 4; ++i) y[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
  }
  return y;
}

/// x, y, ẋ, ẏ at the end, by the law of fall and by Runge and Kutta's method.
Eigen::Vector4d OutcomeOfLanding(const Vector& x) {
  const double landing = (x(5) + std::sqrt(x(5) * x(5) + 2 * kGravity * x(2))) / kGravity;
  Glide y = GlideOn({x(0), x(1), x(3), x(4)}, landing, 0);
  y[2] = y[3] = 0;
  y = GlideOn(y, kLandedDuration - landing, kLandedFriction * kGravity);
  return {y[0], y[1], y[2], y[3]};
}

TEST(SlipAfterLanding, HasTheDerivativeOfItsMotion) {
  const auto tip = MakeSystem<test::Tip<3>>({{"mu0", kLandedFriction},
                                             {"f0", kSpringX * kSpringRestX},
                                             {"f1", kSpringY * kSpringRestY},
                                             {"f2", -kGravity},
                                             {"k0", kSpringX},
                                             {"k1", kSpringY}});
  Vector x(6);
  x << 0.05, -0.1, 0.3, 0.1, -0.2, -1.5;
  const SimulateOptions tight = test::Tight();
  const Trajectory run = Simulate(*tip, x, Vector(), kLandedDuration, tight);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ("l", run.transitions[0].mode_after.Word(1));
  EXPECT_EQ("s", run.transitions[0].impulse_word.Word(1));
  const Vector& end = run.FinalState();
  const Eigen::Vector4d expected = OutcomeOfLanding(x);
  const int rows[] = {0, 1, 3, 4};
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(expected(i), end(rows[i]), 1e-9);
  const BDerivative B = DifferentiateOutcome(*tip, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  constexpr double kStep = 1e-4;
  for (int j = 0; j < 6; ++j) {
    const Vector w = Vector::Unit(6, j), got = B(w);
    const Eigen::Vector4d quotient =
        (OutcomeOfLanding(x + kStep * w) - OutcomeOfLanding(x - kStep * w)) / (2 * kStep);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(quotient(i), got(rows[i]), 3e-7) << i << " by " << j;
  }
}

}  // namespace
}  // namespace contact_flow
