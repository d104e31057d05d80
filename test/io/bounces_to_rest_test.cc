// SPDX-License-Identifier: BSD-3-Clause
// Bounces too low to be resolved come to rest, and nothing else does.
#include <gtest/gtest.h>

#include <cmath>

#include "test/io/moving_robots.h"

namespace contact_flow {
namespace {

using test::Make;
using test::Text;
using test::Tight;

/// A block on two feet 0.2 m apart, so slender that the landing of one throws the other up.
RobotSystem Rocking(double restitution, double friction) {
  const std::string feet = ", restitution: " + Text(restitution) +
                           (friction > 0 ? ", friction: " + Text(friction) : "") + "}";
  return Make(
      "<robot name=\"block\"><link name=\"block\"><inertial><mass value=\"1\"/><inertia "
      "ixx=\"0.05\" iyy=\"0.05\" izz=\"0.05\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
      "</robot>",
      "{base: planar, constraints: {"
      "left: {kind: plane, link: block, point: [-0.1, 0, -0.3]" +
          feet +
          ", "
          "right: {kind: plane, link: block, point: [0.1, 0, -0.3]" +
          feet +
          "}, "
          "nominal: {positions: {base_z: " +
          Text(0.3 * std::cos(0.1) + 0.1 * std::sin(0.1)) + ", base_pitch: -0.1}}}");
}

/// What an impact throws up is no part of the bounces of another contact that come to their end at
/// once: the motion is that of plastic feet, to first order in the restitution γ.
TEST(BouncesToRest, LeaveAloneWhatIsThrownUp) {
  for (const double friction : {0.0, 0.1, 2.0}) {
    SimulateOptions options = Tight();
    options.complete_zeno = true;
    const RobotSystem plastic = Rocking(0, friction);
    const Vector u = plastic.nominal().u;
    const Trajectory expected = Simulate(plastic, plastic.nominal().x, u, 0.4, options);
    ASSERT_TRUE(expected.status.ok()) << expected.status.message;
    ASSERT_GE(expected.transitions.size(), 1u);
    const Transition& landing = expected.transitions[0];
    ASSERT_TRUE(landing.activated.Contains(1) && landing.released.Contains(0));
    for (const double restitution : {1e-8, 1e-6, 1e-4}) {
      const RobotSystem elastic = Rocking(restitution, friction);
      const Trajectory run = Simulate(elastic, elastic.nominal().x, u, 0.4, options);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      EXPECT_LT((run.FinalState() - expected.FinalState()).cwiseAbs().maxCoeff(), 100 * restitution)
          << friction;
      EXPECT_GT(run.num_warnings, 0);
      for (const Transition& transition : run.transitions) {
        EXPECT_GE(transition.impulse.head(2).minCoeff(), -1e-9) << "nothing pulls";
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
