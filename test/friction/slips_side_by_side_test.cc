// SPDX-License-Identifier: BSD-3-Clause
// Slips of wheels that share nothing end shortly after each other: each as if it were alone.
#include <gtest/gtest.h>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/systems/two_wheels.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::TwoWheels;

/// The slip falls by a = μ g (1 + r²/I) − push; then v̇ jumps from push − μ g to 0, where the wheel
/// rolls, or to push + μ g, where it is pushed back. By the speed, x changes by
///   t + (1 − jump/a) (T − t),  t when the slip ends.
TEST(SlipsSideBySide, EndOneAfterTheOther) {
  constexpr double kSpeed = 2, kDuration = 0.25, kSpin = 1, kGrip = TwoWheels::kMu * test::kGravity;
  constexpr double kRadius = TwoWheels::kRadius, kInertia = TwoWheels::kInertia;
  for (const double push : {0.0, -40.0}) {
    const auto wheels = MakeSystem<TwoWheels>({{"push", push}});
    const double slows = kGrip * (1 + kRadius * kRadius / kInertia) - push;
    const double kept = 1 - (push == 0 ? kGrip : 2 * kGrip) / slows;
    for (const double apart : {0.0, 1e-14, 1e-12, 1e-11, 1e-10, 3e-10, 1e-9, 1e-8, 1e-6}) {
      const double speeds[] = {kSpeed, kSpeed + slows * apart};
      const Vector x = test::Entries({0, 0, 0, 0, 0, 0, speeds[0], 0, kSpin, speeds[1], 0, kSpin});
      const Trajectory run = Simulate(*wheels, x, Vector(0), kDuration);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      const BDerivative B = DifferentiateOutcome(*wheels, run);
      ASSERT_TRUE(B.status.ok()) << push << ", " << apart << ": " << B.status.message;
      for (const auto& w : {Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0), Eigen::Vector2d(0, 1),
                            Eigen::Vector2d(0, -1), Eigen::Vector2d(1, -1)}) {
        const Vector found = B(test::Entries({0, 0, 0, 0, 0, 0, w(0), 0, 0, w(1), 0, 0}));
        for (const int i : {0, 1}) {
          const double end = (speeds[i] - kRadius * kSpin) / slows;
          const double moved = end + kept * (kDuration - end);
          EXPECT_NEAR(moved * w(i), found(3 * i), 1e-6) << push << ", " << apart;
          EXPECT_NEAR(kept * w(i), found(6 + 3 * i), 1e-6) << push << ", " << apart;
        }
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
