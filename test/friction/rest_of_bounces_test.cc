// SPDX-License-Identifier: BSD-3-Clause
// Bounces of what slips, completed to rest.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/io/controlled_robots.h"

namespace contact_flow {
namespace {

/// While a puck slips, and whether it bounces or not, friction takes μ times what the floor gives
/// along z, which is m (u + g t) from its fall with u on: its speed is v₀ − μ (u + g t), whatever
/// its restitution, and where the bounces are taken to have ended.
TEST(RestOfBounces, TakesOfASlipWhatTheBouncesWould) {
  const double g = 9.81, mu = 0.4, fall = 0.1, u = g * fall, after = 0.3;
  const Eigen::Vector2d v(1.8, -2.4);
  for (const double restitution : {0.0, 1e-6, 1e-4, 0.01, 0.1, 0.3}) {
    const auto puck = MakeModel(
        "puck", {{"gravity", g}, {"friction", mu}, {"restitution", restitution}, {"mass", 2}});
    Vector x = puck->nominal().x;
    ASSERT_EQ(6, x.size());
    x << 0, 0, 0.5 * g * fall * fall, v, 0;
    SimulateOptions options;
    options.complete_zeno = true;
    const Trajectory run =
        Simulate(*puck, x, Vector::Zero(puck->num_inputs()), fall + after, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    EXPECT_EQ(Letter::kSlip, run.arcs.back().mode.LetterOf(0));
    EXPECT_EQ(restitution > 0, run.transitions.back().completes_zeno);
    const Vector expected = v - mu * (u + g * after) * v.normalized();
    EXPECT_LT((run.FinalState().segment<2>(3) - expected).norm(), 1e-8) << restitution;
  }
}

/// A mass on three rails whose slip the first impact stops sticks behind its bounces: what is left
/// of the slip is rounding beside what the impacts take, though not beside what they leave.
TEST(RestOfBounces, RoundingIsNoSlip) {
  using test::Joint;
  using test::Link;
  const std::string urdf = test::Robot(
      Link("bx", "1.805") + Link("by", "1.483") + Link("bz", "0.651") +
      Joint("x", "prismatic", "world", "bx", "1 0 0") +
      Joint("y", "prismatic", "bx", "by", "0 1 0") + Joint("z", "prismatic", "by", "bz", "0 0 1"));
  for (const double restitution : {1e-6, 3e-5, 4.9e-5, 1.5e-4, 2e-3, 7.6e-3}) {
    for (const double angle : {0.0, 0.2, 1.1, 2.0, 3.0, 4.4, 5.9}) {
      SCOPED_TRACE(testing::Message() << restitution << ", angle " << angle);
      const RobotSystem mass = test::Make(
          urdf,
          "{base: fixed, gravity: 10, constraints: {foot: {kind: plane, link: bz, point: [0, 0, "
          "0], "
          "restitution: 0.5, friction: 0.8}}, parameters: {restitution: foot/restitution}}",
          {{"restitution", restitution}});
      Vector x(6);
      x << 0, 0, 0.45, 0.29 * std::cos(angle), 0.29 * std::sin(angle), -1;
      SimulateOptions options;
      options.complete_zeno = true;
      const Trajectory run = Simulate(mass, x, Vector::Zero(0), 0.4, options);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      EXPECT_EQ(Letter::kStick, run.arcs.back().mode.LetterOf(0));
      EXPECT_LT(run.FinalState().tail<3>().norm(), 1e-15);
    }
  }
}

}  // namespace
}  // namespace contact_flow
