// SPDX-License-Identifier: BSD-3-Clause
// Motions of the example models that are known in closed form.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::Tight;
using test::kGravity;

/// Falls of duration t₁, then bounces of 2 γᵏ t₁: t_k = t₁ (1 + 2γ + … + 2γᵏ).
TEST(BouncingBall, BouncesAtTheTimesOfTheClosedForm) {
  constexpr double kRestitution = 0.7;
  const auto ball = MakeModel("bouncing_ball", {{"restitution", kRestitution}});
  const Trajectory run = Simulate(*ball, ball->nominal().x, Vector(0), 2.4, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_GE(run.transitions.size(), 8u);
  const double fall = std::sqrt(2 / kGravity);
  double t = fall, speed = kGravity * fall, interval = 2 * fall;
  for (const Transition& bounce : run.transitions) {
    // Free flight is a parabola, which the integrator follows to rounding, 1e-14 m at most over
    // these arcs; an event is late by that over its speed (0.09 m/s at the slowest), and each
    // passes it on.
    EXPECT_NEAR(t, bounce.t, 1e-11);
    EXPECT_NEAR(-speed, bounce.x_minus(3), 1e-10);
    EXPECT_NEAR(kRestitution * speed, bounce.x_plus(3), 1e-10);
    EXPECT_NEAR(t, bounce.x_minus(0), 1e-11) << "it moves forward at 1 m/s";
    interval *= kRestitution;
    speed *= kRestitution;
    t += interval;
  }
}

TEST(BouncingBall, BouncesAccumulateAtTheTimeOfTheClosedForm) {
  const double fall = std::sqrt(2 / kGravity);
  for (double restitution : {0.2, 0.5, 0.7, 0.85}) {
    const auto ball = MakeModel("bouncing_ball", {{"restitution", restitution}});
    const Trajectory run = Simulate(*ball, ball->nominal().x, Vector(0), 20, Tight());
    ASSERT_EQ(Outcome::kZeno, run.status.outcome) << "restitution " << restitution;
    const double exact = fall * (1 + restitution) / (1 - restitution);
    // Stopped at intervals of 1e-5 s, known to 1e-14/speed ~ 1e-10 s, so that the ratio is good to
    // 1e-5 and what is left of the sum (≤ 1e-5 s / (1 − γ)) to 1e-9 s.
    EXPECT_NEAR(exact, run.accumulation_time, 1e-8) << "restitution " << restitution;
    EXPECT_LT(run.t_end(), exact);
    EXPECT_GT(run.t_end(), exact - 2e-5 / (1 - restitution)) << "it stops only when it must";
  }
}

class CeilingRun : public testing::TestWithParam<double> {
 protected:
  Trajectory Throw(double speed) const {
    Vector x(2);
    x << 0, speed;
    return Simulate(*MakeModel("ceiling", {{"height", GetParam()}}), x, Vector(0), 2, Tight());
  }
  double Critical() const { return std::sqrt(2 * kGravity * GetParam()); }
};

TEST_P(CeilingRun, GrazesAtTheSpeedThatJustReachesIt) {
  const Trajectory run = Throw(Critical());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  ASSERT_EQ(1u, run.warnings.size());
  EXPECT_NE(std::string::npos, run.warnings[0].message.find("'ceiling'"));
  EXPECT_EQ(0, run.margins.approach_speed);
  // A gap of g/2 (t − t*)² that is known to 1e-12 m places t* to 5e-7 s.
  EXPECT_NEAR(Critical() / kGravity, run.transitions[0].t, 1e-5);
  EXPECT_NEAR(GetParam(), run.transitions[0].x_minus(0), 1e-9);
}

TEST_P(CeilingRun, MissesItSlowerAndHitsItFaster) {
  constexpr double kShortBy = 1e-3;
  const Trajectory slower = Throw(std::sqrt(2 * kGravity * (GetParam() - kShortBy)));
  EXPECT_TRUE(slower.status.ok()) << slower.status.message;
  EXPECT_TRUE(slower.transitions.empty());
  EXPECT_NEAR(kShortBy, slower.margins.gap, 1e-10);
  for (double speed : {1e-3, 1e-2, 1.0}) {
    const Trajectory faster = Throw(std::sqrt(2 * kGravity * GetParam() + speed * speed));
    EXPECT_TRUE(faster.status.ok()) << faster.status.message;
    ASSERT_EQ(1u, faster.transitions.size());
    // The speed left is the root of a difference of numbers ~ 40, wrong by 40·1e-16·(a few)/speed.
    EXPECT_NEAR(speed, faster.transitions.front().x_minus(1), 1e-13 / speed);
    EXPECT_NEAR(speed, faster.margins.approach_speed, 1e-13 / speed);
  }
}

INSTANTIATE_TEST_SUITE_P(Heights, CeilingRun, testing::Values(0.5, 1.0, 2.0));

/// A block released on its left corner, and k of rocking_block.h.
struct Block {
  Block(double width, double height)
      : system(MakeModel("rocking_block", {{"width", width}, {"height", height}})),
        inertia((width * width + height * height) / 12),
        k(width * width / (4 * inertia)),
        half_width(width / 2),
        half_height(height / 2) {}
  double Energy(const Vector& x) const {  // of 1 kg; x does not move
    return 0.5 * (x(4) * x(4) + inertia * x(5) * x(5)) + kGravity * x(1);
  }
  std::unique_ptr<MechanicalSystem> system;
  double inertia, k, half_width, half_height;
};

TEST(RockingBlock, KeepsItsEnergyWhileItPivots) {
  const Block block(0.2, 1);
  const NominalRun& nominal = block.system->nominal();
  const Trajectory run = Simulate(*block.system, nominal.x, Vector(0), nominal.duration, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_GE(run.transitions.size(), 2u);
  EXPECT_EQ(ContactMode({0}), run.arcs.front().mode);
  for (const Arc& arc : run.arcs) {
    const double energy = block.Energy(arc.x_begin);
    for (int i = 1; i <= 10; ++i) {
      const Vector x = run.State(arc.t_begin + (arc.t_end - arc.t_begin) * i / 10.0);
      // 1e-12 a step, some 20 steps, times the potential's slope of 10 N.
      EXPECT_NEAR(energy, block.Energy(x), 1e-9);
      EXPECT_EQ(0, x(3)) << "nothing pushes it sideways";
      const double base = x(1) - block.half_height * std::cos(x(2));
      const double lift = block.half_width * std::sin(x(2));
      EXPECT_NEAR(0, arc.mode.Contains(0) ? base - lift : base + lift, 1e-9) << "it pivots";
    }
  }
}

TEST(RockingBlock, TheLeadingCornerLetsGoWhenTheOtherLands) {
  for (double width : {0.1, 0.2, 0.4, 0.6}) {  // k = 0.03, 0.12, 0.41, 0.79 < 1
    const Block block(width, 1);
    const Vector& x = block.system->nominal().x;
    const Trajectory run = Simulate(*block.system, x, Vector(0), 0.6, Tight());
    ASSERT_FALSE(run.transitions.empty()) << "width " << width;
    const Transition& landing = run.transitions.front();
    EXPECT_EQ(ConstraintSet({1}), landing.activated);
    EXPECT_EQ(ConstraintSet({0}), landing.released);
    EXPECT_EQ(ContactMode({1}), landing.mode_after);
    // The potential lost turns about the corner: ½ (I + w²/4) ω² = g (z₀ − h/2).
    const double rate = std::sqrt(2 * kGravity * (x(1) - block.half_height) /
                                  (block.inertia + block.half_width * block.half_width));
    EXPECT_NEAR(-rate, landing.x_minus(5), 1e-8);
    EXPECT_NEAR(-rate * (1 - block.k) / (1 + block.k), landing.x_plus(5), 1e-8);
    EXPECT_GT(landing.x_plus(4) - block.half_width * landing.x_plus(5), 1e-2)
        << "left corner rises";
  }
}

TEST(RockingBlock, AWideBlockComesToRest) {
  const Block block(1, 1);  // k = 1.5 > 1
  const Trajectory run =
      Simulate(*block.system, block.system->nominal().x, Vector(0), 0.6, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ(ContactMode({0, 1}), run.transitions.front().mode_after);
  EXPECT_LE(run.FinalState().tail(3).cwiseAbs().maxCoeff(), 1e-9);
}

}  // namespace
}  // namespace contact_flow
