// SPDX-License-Identifier: BSD-3-Clause
// A contact that has just touched, thrown down again by the impact of another.
#include <gtest/gtest.h>

#include "contact_flow/flow/simulate.h"
#include "test/friction/robot_twins.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

/// A bar of mass 1 and inertia 0.05 with feet at ±1, pulled up at 30 m/s²: an impulse p at the
/// right foot changes the speed of the left one by p (1/m − 1/I) = −19 p, its own by 21 p. The
/// right foot comes down at 2e-4 m/s while the left one, 2e-13 m above the ground, rises at
/// 1e-7 m/s: it is thrown down at 1.8e-4 m/s, and would turn back 5e-10 m below the ground, within
/// the tolerance. It hits, and throws the right one down in turn: both end with the bar's spin and
/// fall taken away, but for what the pull gives it.
TEST(ThrownContacts, HitAlsoWhereTheyWouldTurnBackWithinTheTolerance) {
  const auto bar = test::Robot(
      "<robot name='bar'>" + test::Link("bar", 1, 1, 0.05, 1) + "</robot>",
      "{base: planar, gravity: 0, constraints: {left: {kind: plane, link: bar, point: [-1, 0, 0]}, "
      "right: {kind: plane, link: bar, point: [1, 0, 0]}}, efforts: {pull: {kind: constant_force, "
      "link: bar, force: [0, 0, 30]}}}");
  ASSERT_EQ(3, bar->dof());
  // left = z + sin(pitch), right = z − sin(pitch)
  const double left = 2e-13, right = 1e-11, rise = 1e-7, fall = -2e-4;
  const Vector x = test::Entries(
      {0, (left + right) / 2, (left - right) / 2, 0, (rise + fall) / 2, (rise - fall) / 2});
  const double duration = 1e-3;
  SimulateOptions options;
  options.gap_tolerance = 1e-12;
  const Trajectory run = Simulate(*bar, x, Vector::Zero(0), duration, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_GE(run.transitions.size(), 2u);
  const Vector v = run.FinalState().tail(3);
  EXPECT_NEAR(30 * duration, v(1), 2e-6);
  EXPECT_NEAR(0, v(2), 2e-6);
}

}  // namespace
}  // namespace contact_flow
