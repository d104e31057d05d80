// SPDX-License-Identifier: BSD-3-Clause
// One point that slides down a wall onto the floor: the normal of each is a tangent of the other.
// What floor and wall give together is not unique, the motion is.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <memory>
#include <sstream>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

std::unique_ptr<RobotSystem> Foot(double friction, double restitution, double push) {
  RobotTexts texts;
  texts.urdf =
      "<robot name=\"box\"><link name=\"box\"><inertial><mass value=\"2\"/><inertia ixx=\"0.2\" "
      "ixy=\"0\" ixz=\"0\" iyy=\"0.2\" iyz=\"0\" izz=\"0.2\"/></inertial></link></robot>";
  std::ostringstream yaml;
  yaml << "base: planar\nconstraints:\n"
       << "  floor: {kind: plane, link: box, point: [0.1, 0, -0.3], friction: " << friction
       << ", restitution: " << restitution << "}\n"
       << "  wall: {kind: plane, link: box, point: [0.1, 0, -0.3], normal: [-1, 0, 0], offset: 0, "
       << "friction: " << friction << "}\n"
       << "efforts:\n  push: {kind: constant_force, link: box, point: [0.1, 0, -0.3], force: ["
       << push << ", 0, 0]}\n";
  texts.yaml = yaml.str();
  return MakeRobot(texts);
}

TEST(CornerBounce, TheFloorThrowsBackAndTheWallHolds) {
  for (const double friction : {0.1, 0.3}) {
    for (const double restitution : {0.3, 0.5, 1.0}) {
      for (const double push : {0.0, 5.0}) {
        const auto box = Foot(friction, restitution, push);
        Vector x = Vector::Zero(6);
        x.head(2) << -0.1, 0.4;
        const Trajectory run = Simulate(*box, x, Vector(0), 0.2);
        ASSERT_FALSE(run.transitions.empty()) << run.status.message;
        const Transition& hit = run.transitions.front();
        ASSERT_TRUE(hit.activated.Contains(0));
        // (n_f, n_w) v⁺ = (−γ n_f v⁻, 0), by impulses along these two.
        ConstraintTerms terms;
        box->Constraints(hit.x_minus.head(3), hit.x_minus.tail(3), &terms);
        Matrix mass;
        Vector force;
        box->Dynamics(hit.x_minus.head(3), hit.x_minus.tail(3), Vector(0), {}, &mass, &force);
        const Matrix A = terms.jacobian.topRows(2), reach = mass.inverse() * A.transpose();
        const Vector before = A * hit.x_minus.tail(3);
        const Eigen::Vector2d change(-(1 + restitution) * before(0), -before(1));
        const Vector after = hit.x_minus.tail(3) + reach * (A * reach).inverse() * change;
        EXPECT_LT((hit.x_plus.tail(3) - after).norm(), 1e-9 * after.norm());
        EXPECT_FALSE(hit.mode_after.Contains(0));
        EXPECT_NE(Outcome::kNoConsistentImpact, run.status.outcome);
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
