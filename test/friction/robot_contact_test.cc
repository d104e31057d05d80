// SPDX-License-Identifier: BSD-3-Clause
// The tangential maps of a robot's contacts beside the motion of the material that touches.
#include <gtest/gtest.h>

#include <random>

#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/rigid_body/kinematics.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

Vec3<double> PositionOf(const TreeState<double>& state, const AttachedPoint& point) {
  return PointPosition(state, point.body, point.local);
}

/// The point of a body that is now at `position`.
AttachedPoint Mark(const TreeState<double>& state, int body, const Vec3<double>& position) {
  if (body < 0) return {body, position};
  const auto& pose = state.body[static_cast<std::size_t>(body)];
  return {body, pose.rotation.transpose() * (position - pose.position)};
}

class RobotContacts : public testing::TestWithParam<const char*> {
 protected:
  RobotContacts() : robot(LoadRobot(RobotFile(GetParam()))), state(robot->robot().model.tree) {}

  Vector RandomState() {
    std::normal_distribution<double> normal;
    Vector w(2 * robot->dof());
    for (double& value : w) value = 0.3 * normal(generator);
    return robot->Perturb(robot->nominal().x, w);
  }

  std::unique_ptr<RobotSystem> robot;
  TreeState<double> state;
  std::mt19937 generator{3};
};

/// T v is the velocity, along two orthonormal tangents, of the point of the first body that is at
/// the contact, less that of the other's: both by central differences of the marked points'
/// positions, along q(t) = q ⊞ t v. Where the gap is no distance T is |∇a| times that. Along ∇a
/// that velocity is the gap's rate.
TEST_P(RobotContacts, SlipIsTheVelocityOfTheMaterial) {
  const RigidBodyTree& tree = robot->robot().model.tree;
  const int nq = robot->num_positions(), d = robot->dof();
  int seen = 0;
  for (int k = 0; k < 20; ++k) {
    const Vector x = RandomState(), q = x.head(nq), v = x.tail(d);
    ConstraintTerms terms;
    robot->Constraints(q, v, &terms);
    const Vector rate = terms.jacobian * v;
    for (int i = 0; i < robot->num_constraints(); ++i) {
      const ConstraintElement& element = *robot->robot().constraints[static_cast<std::size_t>(i)];
      const Friction& friction = robot->friction()[static_cast<std::size_t>(i)];
      ASSERT_EQ(element.slip.rows, friction.dimension);
      ASSERT_EQ(element.Touches(), friction.dimension > 0);
      if (friction.dimension == 0) continue;
      ++seen;
      UpdatePositions(tree, q.data(), &state);
      std::vector<double> z(static_cast<std::size_t>(element.parts.size()));
      for (std::size_t p = 0; p < element.parts.points.size(); ++p) {
        const Vec3<double> at = PositionOf(state, element.parts.points[p]);
        std::copy(at.data(), at.data() + 3, z.begin() + static_cast<std::ptrdiff_t>(3 * p));
      }
      Vec3<double> arm, push;
      element.Place(z.data(), &arm, &push);
      const Vec3<double> contact = PositionOf(state, element.parts.points[0]) + arm;
      const bool linked = element.parts.turns.size() > 1;
      const AttachedPoint mine = Mark(state, element.parts.points[0].body, contact);
      const AttachedPoint other = Mark(state, linked ? element.parts.turns[1] : -1, contact);
      const auto apart = [&](double t) {
        const Vector moved = robot->space().Retract(q, t * v);
        UpdatePositions(tree, moved.data(), &state);
        return Vec3<double>(PositionOf(state, mine) - PositionOf(state, other));
      };
      constexpr double kStep = 1e-5;
      const Vec3<double> speed = (apart(kStep) - apart(-kStep)) / (2 * kStep);
      std::vector<double> map(static_cast<std::size_t>(2 * element.parts.size()));
      element.SlipMap(z.data(), map.data());
      Vec3<double> tangents[2];
      for (int r = 0; r < friction.dimension; ++r) {
        const double* row = map.data() + r * element.parts.size();
        tangents[r] = Vec3<double>(row[0], row[1], row[2]) / push.norm();
        EXPECT_NEAR(1, tangents[r].norm(), 1e-12);
        EXPECT_NEAR(0, tangents[r].dot(push), 1e-12);
        EXPECT_NEAR(push.norm() * tangents[r].dot(speed), rate(friction.row + r), 1e-6)
            << element.parts.name;
      }
      if (friction.dimension == 2) EXPECT_NEAR(0, tangents[0].dot(tangents[1]), 1e-12);
      if (friction.dimension == 1) EXPECT_EQ(1, element.slip.plane(1));
      EXPECT_NEAR(push.dot(speed), rate(i), 1e-6) << element.parts.name;
    }
  }
  EXPECT_GT(seen, 0);
}

INSTANTIATE_TEST_SUITE_P(Robots, RobotContacts,
                         testing::Values("everything_with_friction", "planar_biped_friction"));

}  // namespace
}  // namespace contact_flow
