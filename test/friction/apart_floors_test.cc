// SPDX-License-Identifier: BSD-3-Clause
// A plank with one foot on a belt and one on firm ground: where its loaded foot sticks, the other
// slips with the belt, however it came there.
#include <gtest/gtest.h>

#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/robot_twins.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::AtTolerance;
using test::Entries;
using test::Robot;

TEST(ApartFloors, TheUnloadedFootSlipsWithTheBelt) {
  const auto plank = Robot(
      "<robot name='plank'><link name='a'><inertial><origin xyz='0.15 0 0'/><mass value='1'/>"
      "<inertia ixx='0.03' iyy='0.03' izz='0.03' ixy='0' ixz='0' iyz='0'/></inertial></link>"
      "</robot>",
      "base: planar\nconstraints:\n"
      "  belt: {kind: plane, link: a, point: [-0.3, 0, -0.1], friction: 0.5, motion: {direction: "
      "[1, 0, 0], velocity: 0.2}}\n"
      "  ground: {kind: plane, link: a, point: [0.3, 0, -0.1], friction: 0.5}\n");
  const int nq = plank->num_positions();
  ASSERT_EQ(4, nq);  // base_x, base_z, base_pitch, clock
  const Vector starts[] = {Entries({0, 0.1, 0, 0, 0, 0, 0, 1}),       // at rest
                           Entries({0, 0.25, 0.1, 0, 0.3, 0, 0, 1}),  // lands
                           Entries({0, 0.1, 0, 0, 0.3, 0, 0, 1})};    // slides to a stop
  for (const Vector& x : starts) {
    const Trajectory run = Simulate(*plank, x, Vector(), 0.8, AtTolerance(1e-10));
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    EXPECT_TRUE(run.warnings.empty()) << run.warnings.front().message;
    EXPECT_EQ("-s", run.arcs.back().mode.Word(2)) << x.transpose();
    EXPECT_NEAR(0, run.FinalState()(nq), 1e-9) << "base_x stands";
    const BDerivative B = DifferentiateOutcome(*plank, run);
    EXPECT_TRUE(B.status.ok()) << B.status.message;
  }
}

}  // namespace
}  // namespace contact_flow
