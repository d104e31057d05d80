// SPDX-License-Identifier: BSD-3-Clause
// A slip in space that begins, and goes on.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/friction/robot_twins.h"
#include "test/model/robots.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

/// A tumbling body falls on a point that sticks, slips and sticks, until the force there reaches
/// its cone: one motion alone goes on, whatever its instant is located to.
TEST(OnsetAhead, OneContactThatReachesItsConeHasOneMotion) {
  RobotTexts texts;
  texts.urdf =
      "<robot name='body'><link name='b'><inertial><origin xyz='0 0 0'/><mass value='0.45415'/>"
      "<inertia ixx='0.0064479' ixy='-0.00322381' ixz='0.00036938' iyy='0.00626154' "
      "iyz='0.00175967' izz='0.00937233'/></inertial></link></robot>";
  texts.yaml =
      "{base: floating, gravity: 9.81, nominal: {duration: 0.5}, constraints: {corner: {kind: "
      "plane, link: b, point: [-0.182917, 0.0910514, 0.0685332], friction: 0.771}}}";
  const auto body = MakeRobot(texts);
  const Vector x = test::Entries({0, 0, -0.013822355278, 0.170326742861, 0.891268712463,
                                  -0.371096206481, -0.197272524623, -1.42018867021, 0.27117889966,
                                  -1.87411701516, 0.461639879109, 0.869864313670, -1.83554544670});
  for (const double tolerance : {1e-9, 1e-11}) {
    SimulateOptions options = test::AtTolerance(tolerance);
    options.dense = true;
    const double duration = 0.25;
    const Trajectory run = Simulate(*body, x, Vector::Zero(0), duration, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ("l", run.arcs.back().mode.Word(1));
    ASSERT_EQ("s", run.arcs[run.arcs.size() - 2].mode.Word(1));
    const BDerivative B = DifferentiateOutcome(*body, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    const Vector w =
        test::Entries({0.3, -0.2, 0.5, 0.1, 0.4, -0.3, 0.2, 0.6, -0.1, 0.5, -0.4, 0.3});
    const QuotientReport report =
        CompareWithQuotients(*body, x, Vector::Zero(0), duration, w, B(w), {1e-4, 1e-5, 1e-6});
    const double first = report.samples[0].error;
    EXPECT_LT(first, 1e-3 * B(w).norm());
    EXPECT_NEAR(0.1, report.samples[1].error / first, 0.02);
    EXPECT_LT(report.samples[2].error / first, 0.02);
  }
}

/// The speed of 1e-8 m/s that a slip is given to begin with changes the forces of stiff servos by
/// 1e-6 of what they are: the law of the event counts it.
TEST(OnsetAhead, TheSpeedOfABeginningMayMoveStiffServos) {
  const auto robot = LoadRobot(RobotFile("quadruped_friction"));
  Vector x = robot->nominal().x;
  x.segment<6>(robot->num_positions()) +=
      test::Entries({0.048, 1.314, -0.007, 0.048, 0.133, 0.187});
  const Vector u = robot->nominal().u;
  const double duration = 0.26;
  SimulateOptions options;
  options.dense = true;
  const Trajectory run = Simulate(*robot, x, u, duration, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ("lsss", run.arcs.back().mode.Word(4));
  const BDerivative B = DifferentiateOutcome(*robot, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  Vector w(2 * robot->dof());
  for (int k = 0; k < w.size(); ++k) w(k) = std::sin(k + 1.0) * (k < robot->dof() ? 0.1 : 1);
  const QuotientReport report = CompareWithQuotients(*robot, x, u, duration, w, B(w), {1e-5, 1e-6});
  EXPECT_LT(report.samples.back().error, 1e-4 * B(w).norm()) << report.samples.front().error;
}

/// Two masses fall beside a third that stands, and push it by dampers, one to the right, the other
/// to the left half as much; they land at once. Where the weak one lands first, the other makes the
/// third slip in between: that is refused. It was not a number.
TEST(OnsetAhead, BetweenTwoLandingsIsRefused) {
  const auto robot = test::Robot(
      "<robot name='r'><link name='world'/>" + test::OnSlides("left", 2) +
          test::OnSlides("middle", 2) + test::OnSlides("right", 1) + "</robot>",
      "{base: fixed, constraints: {left: {kind: plane, link: left, point: [0, 0, 0], friction: "
      "0.3}, middle: {kind: plane, link: middle, point: [0, 0, 0], friction: 0.08}, right: {kind: "
      "plane, link: right, point: [0, 0, 0], friction: 0.3}}, efforts: {push: {kind: point_spring, "
      "link: middle, point: [0, 0, 0], other_link: left, other_point: [0, 0, 1], length: 0, "
      "stiffness: 0, damping: 2}, hold: {kind: point_spring, link: middle, point: [0, 0, 0], "
      "other_link: right, other_point: [0, 0, 1], length: 0, stiffness: 0, damping: 1}}}");
  Vector x = Vector::Zero(18);
  x(0) = -1;
  x(6) = 1;
  x(2) = x(8) = 0.3;
  const Vector u = Vector::Zero(0);
  const double duration = 0.3;
  const Trajectory run = Simulate(*robot, x, u, duration, test::Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2, run.transitions.front().activated.Size());
  ASSERT_EQ("sss", run.arcs.back().mode.Word(3));
  const BDerivative B = DifferentiateOutcome(*robot, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_FALSE(B.IsDifferentiable());
  Vector w = Vector::Zero(18);
  w(0) = 0.3;
  w(8) = 1;  // the right one lands later
  const QuotientReport report = CompareWithQuotients(*robot, x, u, duration, w, B(w), {1e-4, 1e-5});
  EXPECT_LT(report.samples[0].error, 1e-2);
  EXPECT_NEAR(0.1, report.samples[1].error / report.samples[0].error, 0.02);
  w(8) = -1;
  EXPECT_THROW(B(w), std::domain_error);
}

}  // namespace
}  // namespace contact_flow
