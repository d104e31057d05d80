// SPDX-License-Identifier: BSD-3-Clause
// A motor drives a slide that its stop holds, first on its limit, then below it: its input moves
// nothing on the whole arc. Behind the limit that is rounding of what the stops push, which has to
// be known by looks there; it was resolved in 1e5 steps, where the run has ten.
#include <gtest/gtest.h>

#include <string>

#include "contact_flow/derivative/variation.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

std::string Part(const std::string& name) {
  return "<link name=\"" + name +
         "\"><inertial><origin xyz=\"0.01 0 -0.15\"/><mass value=\"0.7\"/><inertia ixx=\"0.01\" "
         "iyy=\"0.012\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>";
}

std::string HeldJoint(const std::string& name, const std::string& type, const std::string& parent,
                      const std::string& child, const std::string& axis) {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child +
         "\"/><origin xyz=\"0.1 0 -0.1\" rpy=\"0 0.3 0\"/><axis xyz=\"" + axis +
         "\"/><limit lower=\"-3\" upper=\"3\" effort=\"9\" velocity=\"9\"/></joint>";
}

std::unique_ptr<RobotSystem> MakeHeldCart() {
  RobotTexts texts;
  texts.urdf = "<robot name=\"held\"><link name=\"base\"/>" + Part("cart") + Part("arm") +
               Part("hand") + HeldJoint("rail", "prismatic", "base", "cart", "0.3 0 1") +
               HeldJoint("shoulder", "revolute", "cart", "arm", "0 1 0") +
               HeldJoint("wrist", "revolute", "arm", "hand", "0 1 0") + "</robot>";
  texts.yaml = R"(
base: fixed
constraints:
  rest: {kind: lower_limit, joint: rail, lower: 0}
  stop: {kind: upper_limit, joint: shoulder, upper: 0.4}
efforts:
  motor: {kind: track, joint: rail, feed_forward: push, stiffness: 80, limit: 4,
          reference: {times: [0, 0.4], values: [-0.2, 0.02]}}
  hold: {kind: joint_spring, joint: shoulder, stiffness: 30, rest: 1.5}
  swing: {kind: joint_spring, joint: wrist, stiffness: 3, damping: 0.1}
nominal: {positions: {rail: 0, shoulder: 0.4, wrist: 0.5}, velocities: {wrist: 2}}
)";
  return MakeRobot(texts);
}

TEST(HeldSource, RoundingBehindALimitNeedsNoSteps) {
  const auto cart = MakeHeldCart();
  const NominalRun& start = cart->nominal();
  const Trajectory run = Simulate(*cart, start.x, start.u, 0.3);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.arcs.size());
  ASSERT_EQ(2u, run.arcs[0].mode.Members().Size());
  ContactDynamics dynamics(*cart, start.u, Variables{true, {}});
  VariationStatistics statistics;
  const Matrix phi = PropagateArc(&dynamics, run.arcs[0], 1e-9, &statistics);
  EXPECT_LT(statistics.jacobians, 1000);
  EXPECT_LT(phi.topRows(2 * cart->dof()).rightCols(1).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace contact_flow
