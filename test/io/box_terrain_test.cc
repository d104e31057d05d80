// SPDX-License-Identifier: BSD-3-Clause
// Boxes that stand on the ground.
#include <gtest/gtest.h>

#include "src/model/rigid_body/constraint/box.h"
#include "test/io/moving_robots.h"

namespace contact_flow {
namespace {

using test::Block;
using test::ExpectQuotients;
using test::Make;
using test::RunOf;

/// At its own (x, y): level on top, through the edge on the ground, twice as deep around it.
TEST(Boxes, HaveALevelTopAndLeaningSides) {
  const double number[] = {1, 0.5, 0.1, 0.4, 0.3, 0.2, 0.7, 0.02};  // c, l, w, h, yaw, riser
  const auto height = [&](double x, double y) {
    const double c = std::cos(0.7), s = std::sin(0.7);
    const double z[] = {1 + c * x - s * y, 0.5 + s * x + c * y, 0};
    double slope_x, slope_y;
    return constraint::Box::Height(number, z, &slope_x, &slope_y);
  };
  EXPECT_NEAR(0.2, height(0, 0), 1e-15);
  EXPECT_NEAR(0.2, height(-0.189, 0.139), 1e-15);
  for (const double side : {1.0, -1.0}) {
    EXPECT_NEAR(0, height(side * 0.2, 0.05), 1e-14);
    EXPECT_NEAR(0, height(-0.1, side * 0.15), 1e-14);
    EXPECT_NEAR(-0.2, height(side * 0.22, 0), 1e-14);
  }
}

/// A point that falls bounces on the top; one that is thrown meets the side: half way up, at σ =
/// 3/4 of 2 h, its speed turns about the normal there.
TEST(Boxes, AreBouncedOff) {
  const std::string box =
      "{constraints: {floor: {kind: plane, link: block}, crate: {kind: box, link: block, center: "
      "[1, "
      "0, 0.1], length: 0.4, width: 0.3, height: 0.2, riser: 0.02, restitution: 0.5}}, ";
  const std::string falls = box + "nominal: {positions: {x: 0.9, z: 0.7}, velocities: {x: 0.5}}}";
  const RobotSystem top = Make(Block(), falls);
  const Trajectory run = RunOf(top, 0.4);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const double fall = std::sqrt(2 * 0.5 / 9.81), up = 0.5 * 9.81 * fall, rest = 0.4 - fall;
  EXPECT_NEAR(0.2 + up * rest - 0.5 * 9.81 * rest * rest, run.FinalState()(1), 1e-10);
  ExpectQuotients(Block(), falls, 0.4);
  const std::string flies =
      box + "gravity: 0, nominal: {positions: {x: 0.5, z: 0.1}, velocities: {x: 2}}}";
  const RobotSystem side = Make(Block(), flies);
  const Trajectory hit = RunOf(side, 0.3);
  ASSERT_TRUE(hit.status.ok()) << hit.status.message;
  ASSERT_EQ(1u, hit.transitions.size());
  double t = 0.5;  // σ(t) = 3/4, by Newton's method
  for (int k = 0; k < 20; ++k) {
    t -= (t * t * t * (10 - t * (15 - 6 * t)) - 0.75) / (30 * t * t * (1 - t) * (1 - t));
  }
  EXPECT_NEAR((0.29 + 0.02 * t) / 2, hit.transitions[0].t, 1e-10);
  const double slope = 0.4 * 30 * t * t * (1 - t) * (1 - t) / 0.02;
  const Eigen::Vector2d n(-slope, 1), spread(-slope, 2), v(2, 0);  // M = diag(1, ½)
  const Eigen::Vector2d after = v - 1.5 * spread * n.dot(v) / n.dot(spread);
  EXPECT_LT((hit.FinalState().tail(2) - after).norm(), 1e-8);
  ExpectQuotients(Block(), flies, 0.3);
}

}  // namespace
}  // namespace contact_flow
