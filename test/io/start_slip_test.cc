// SPDX-License-Identifier: BSD-3-Clause
// Slips at the start that count as none: the derivatives closer to the start, and farther from it.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/cluster_reading.h"
#include "test/io/moving_robots.h"

namespace contact_flow {
namespace {

using test::Block;
using test::Make;
using test::Tight;

/// A block that slides down a slope of 2/5 from a speed s that counts as none. Directions that move
/// it uphill are reversed, from the α on at which they overcome s.
TEST(StartSlip, IsReversedBeyondTheInnerRadius) {
  const RobotSystem block =
      Make(Block(),
           "{constraints: {block: {link: block, kind: plane, normal: [-0.4, 0, 1], friction: "
           "0.2}}}");
  const double T = 0.3;
  for (const double s : {1e-8, -1e-8, 3e-7}) {
    Vector x = Vector::Zero(4);
    x(2) = -s;
    x(3) = -0.4 * s;
    const Trajectory run = Simulate(block, x, Vector(0), T, Tight());
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    const BDerivative B = DifferentiateOutcome(block, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    Vector w(4);
    w << 0, 0, 1, 0.4;  // uphill
    if (s < 0) w = -w;
    const ClusterReading reading = ReadClusters(B, w);
    EXPECT_NEAR(std::abs(s), reading.inner_radius, 1e-6 * std::abs(s));
    EXPECT_EQ(0, ReadClusters(B, -w).inner_radius);
    const auto quotient = [&](double alpha) -> Vector {
      const Trajectory other = Simulate(block, x + alpha * w, Vector(0), T, Tight());
      EXPECT_TRUE(other.status.ok()) << other.status.message;
      return (other.FinalState() - run.FinalState()) / alpha;
    };
    const double far = 1e4 * std::abs(s), near = 0.5 * std::abs(s);
    EXPECT_LT((quotient(far) - B(w)).norm(), 2e-4 + 10 * far);
    EXPECT_GT((reading.in_order - B(w)).norm(), 0.1);
    if (s > 0) EXPECT_LT((quotient(near) - reading.in_order).norm(), 1e-3 + 1e-11 / near);
  }
}

}  // namespace
}  // namespace contact_flow
