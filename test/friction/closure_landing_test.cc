// SPDX-License-Identifier: BSD-3-Clause
// A double pendulum that lands with friction: its pivot once a hinge, once a loop closure.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/robot_twins.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::AtTolerance;
using test::Entries;
using test::Robot;

/// The pivot is this far behind the origin of the upper link.
constexpr double kPivot = 0.2;

std::string Links(double origin) {
  const auto link = [](const char* name, double com) {
    return std::string("<link name='") + name + "'><inertial><origin xyz='" + std::to_string(com) +
           " 0 0'/><mass value='1'/><inertia ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' "
           "izz='0.01'/></inertial></link>";
  };
  return link("upper", 0.3 - origin) + link("lower", 0.3) +
         "<joint name='elbow' type='continuous'><parent link='upper'/><child link='lower'/>"
         "<origin xyz='" +
         std::to_string(0.6 - origin) + " 0 0'/><axis xyz='0 1 0'/></joint></robot>";
}

std::string LandingTip(const std::string& friction) {
  return "constraints: {tip: {kind: plane, link: lower, point: [0.6, 0, 0], offset: -0.6, "
         "friction: " +
         friction + "}}\n";
}

/// The impulses of the closure turn with the body that they hold: their part in Ξ.
TEST(ClosureLanding, HasTheDerivativeOfAHinge) {
  const std::string hinge =
      "<joint name='pivot' type='continuous'><parent link='ground'/>"
      "<child link='upper'/><axis xyz='0 1 0'/></joint>";
  for (const char* friction : {"0.4", "no_slip"}) {
    const auto plain = Robot("<robot name='hinged'><link name='ground'/>" + hinge + Links(0),
                             "base: fixed\n" + LandingTip(friction));
    const auto closed = Robot("<robot name='closed'>" + Links(kPivot),
                              "base: planar\nclosures: {pin: {link: upper, point: [-0.2, 0, 0], "
                              "other_link: world, other_point: [0, 0, 0], axes: xz}}\n" +
                                  LandingTip(friction));
    const double pitch = 0.1, elbow = 0.3, s = std::sin(pitch), c = std::cos(pitch);
    const auto outcome = [&](const auto& robot, const Vector& x, const Vector& w) {
      const Trajectory run = Simulate(*robot, x, Vector(), 0.4, AtTolerance(1e-12));
      EXPECT_TRUE(run.status.ok()) << run.status.message;
      EXPECT_EQ(1u, run.transitions.size());
      BDerivativeOptions options;
      options.tolerance = 1e-11;
      const BDerivative B = DifferentiateOutcome(*robot, run, options);
      EXPECT_TRUE(B.status.ok()) << B.status.message;
      return B(w);
    };
    // (pitch, elbow) and (x, z, pitch, elbow)
    const Vector one = outcome(plain, Entries({pitch, elbow, 0, 0}), Entries({1, 0, 0, 0}));
    const Vector other =
        outcome(closed, Entries({kPivot * c, -kPivot * s, pitch, elbow, 0, 0, 0, 0}),
                Entries({-kPivot * s, -kPivot * c, 1, 0, 0, 0, 0, 0}));
    EXPECT_TRUE(one.isApprox(Entries({other(2), other(3), other(6), other(7)}), 1e-8))
        << friction << ": " << one.transpose() << " and " << other.transpose();
  }
}

/// A four-bar flies, with friction at one joint, until another is stopped: both hold the loop from
/// there on, on rows that depend on each other. What directions leave of its motion is rounding.
TEST(ClosureLanding, StoppedFourBarKeepsItsDirections) {
  const double crank = 0.1, coupler = 0.28, rocker = 0.22, base = 0.3;
  const double angle = 1.2;  // of the crank, from straight down
  const Eigen::Vector2d elbow(-crank * std::sin(angle), -crank * std::cos(angle));
  const Eigen::Vector2d across = Eigen::Vector2d(base, 0) - elbow;
  const double far = across.norm(),
               inner = std::acos((coupler * coupler + far * far - rocker * rocker) /
                                 (2 * coupler * far));
  const double second = std::atan2(-across(0), -across(1)) - inner;
  const Eigen::Vector2d end =
      elbow + coupler * Eigen::Vector2d(-std::sin(second), -std::cos(second));
  const double third = std::atan2(-(end(0) - base), -end(1));
  const auto link = [](const std::string& name, double mass, double com) {
    return "<link name='" + name + "'><inertial><origin xyz='0 0 " + std::to_string(com) +
           "'/><mass value='" + std::to_string(mass) +
           "'/><inertia ixx='.004' ixy='0' ixz='0' iyy='.004' iyz='0' izz='.004'/></inertial>"
           "</link>";
  };
  const auto joint = [](const std::string& name, const std::string& parent,
                        const std::string& child, const std::string& at, double low, double high) {
    return "<joint name='" + name + "' type='revolute'><parent link='" + parent +
           "'/><child link='" + child + "'/><origin xyz='" + at +
           "'/><axis xyz='0 1 0'/><limit lower='" + std::to_string(low) + "' upper='" +
           std::to_string(high) + "' effort='9' velocity='9'/><dynamics friction='0.6'/></joint>";
  };
  const auto robot = Robot(
      "<robot name='four_bar'>" + link("b", 1, 0) + link("c1", 0.4, -0.05) +
          link("c2", 0.3, -0.12) + link("c3", 0.4, -0.1) + joint("q1", "b", "c1", "0 0 0", -9, 9) +
          joint("q2", "c1", "c2", "0 0 -0.1", -9, 9) +
          joint("q3", "b", "c3", "0.3 0 0", third - 0.02, third + 0.02) + "</robot>",
      "{base: planar, gravity: 0, joints: {limits: [q3], restitution: 0, friction: [q1]}, "
      "closures: {loop: {link: c2, point: [0, 0, -0.28], other_link: c3, other_point: [0, 0, "
      "-0.22], axes: xz}}, efforts: {m: {kind: actuator, joint: q1, input: u}}}");
  const int d = robot->dof();  // the last is that of the joint with friction
  ASSERT_EQ(7, d);
  Vector x = Entries({0, 0, 0, angle, second - angle, third, 0, 0.3, 0.2, 0.7, -2, 0, 0, 0});
  ConstraintTerms terms;
  robot->Constraints(x.head(d), x.tail(d), &terms);
  const Matrix loop = terms.jacobian.block(robot->num_constraints(), 0, 2, d - 1);
  ASSERT_LT(terms.gap.segment(robot->num_constraints(), 2).norm(), 1e-6);
  auto v = x.segment(d, d - 1);
  v -= loop.completeOrthogonalDecomposition().solve(loop * v).eval();
  const Vector u = Vector::Constant(1, -1);
  const double duration = 0.12;
  const Trajectory run = Simulate(*robot, x, u, duration, test::Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ("los", run.arcs.back().mode.Word(3));
  const BDerivative B = DifferentiateOutcome(*robot, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (int k = 0; k < 2 * d; ++k) {
    const Vector w = ProjectAdmissible(*robot, x, run.arcs.front().mode, Vector::Unit(2 * d, k));
    const QuotientReport report =
        CompareWithQuotients(*robot, x, u, duration, w, B(w), {1e-4, 1e-5});
    EXPECT_LT(report.samples[1].error, 1e-3 * (1 + B(w).norm())) << "direction " << k;
  }
}

}  // namespace
}  // namespace contact_flow
