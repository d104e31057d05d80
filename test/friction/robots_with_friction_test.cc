// SPDX-License-Identifier: BSD-3-Clause
// The robots of config/robots with friction: they stand, are pushed, slide and hold.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::Tight;

/// Lands on four feet, which stick, and comes to rest under its servos.
TEST(RobotsWithFriction, QuadrupedStands) {
  const auto robot = LoadRobot(RobotFile("quadruped_friction"));
  const Trajectory run = Simulate(*robot, robot->nominal().x, robot->nominal().u, 8);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("ssss", run.arcs[1].mode.Word(4));
  EXPECT_LT(run.FinalState().tail(18).cwiseAbs().maxCoeff(), 1e-6);
}

/// Dropped from higher on a narrow stance, its front feet begin to slip at one instant: both
/// do, and the motion stays as symmetric as the robot is.
TEST(RobotsWithFriction, QuadrupedBeginsToSlipOnTwoFeet) {
  RobotTexts texts = ReadRobotTexts(RobotFile("quadruped"));
  for (std::size_t at = 0; (at = texts.yaml.find("radius: 0.02}", at)) != std::string::npos;) {
    texts.yaml.insert(at + 12, ", friction: 0.7");
  }
  const auto robot = MakeRobot(texts);
  const Trajectory run = Simulate(*robot, robot->nominal().x, robot->nominal().u, 0.2142);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(3u, run.arcs.size());
  EXPECT_EQ("ssss", run.arcs[1].mode.Word(4));
  EXPECT_EQ("llss", run.arcs[2].mode.Word(4));
  const Vector q = run.FinalState().head(19), v = run.FinalState().tail(18);
  ConstraintTerms terms;
  robot->Constraints(q, v, &terms);
  const Vector rate = terms.jacobian * v;
  const int left = robot->friction()[0].row, right = robot->friction()[1].row;
  EXPECT_GT(rate.segment(left, 2).norm(), 1e-8);
  EXPECT_NEAR(rate(left), rate(right), 1e-6 * rate.segment(left, 2).norm() + 1e-9);
  EXPECT_NEAR(rate(left + 1), -rate(right + 1), 1e-6 * rate.segment(left, 2).norm() + 1e-9);
  EXPECT_LT(rate.segment(robot->friction()[2].row, 4).norm(), 1e-8) << "the hind feet stick";
}

/// Stands, is pushed, slides, stops and stands again.
TEST(RobotsWithFriction, PlanarBipedIsPushed) {
  const auto robot = LoadRobot(RobotFile("planar_biped_friction"));
  const Vector u = robot->nominal().u;
  Trajectory run = Simulate(*robot, robot->nominal().x, u, 3);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_EQ("ssoo", run.arcs.back().mode.Word(4));
  Vector x = run.FinalState();
  x(robot->num_positions()) += 0.2;
  run = Simulate(*robot, x, u, 6);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_EQ("++oo", run.arcs.front().mode.Word(4));
  EXPECT_EQ("ssoo", run.arcs.back().mode.Word(4));
  EXPECT_LT(run.FinalState().tail(robot->dof()).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_GT(run.FinalState()(0), x(0) + 1e-3) << "its base has moved on";
}

/// It lands on two plastic feet, which hit in turns with impulses that fall a thousandfold: however
/// many of them a tolerance resolves, both hold at last.
TEST(RobotsWithFriction, PlanarBipedLandsAtAnyTolerance) {
  const auto robot = LoadRobot(RobotFile("planar_biped_friction"));
  const NominalRun& nominal = robot->nominal();
  Vector last;
  for (const double absolute : {1e-9, 1e-12, 1e-13}) {
    for (const double speed : {1e-6, 1e-9}) {
      SimulateOptions options;
      options.absolute_tolerance = absolute;
      options.relative_tolerance = 10 * absolute;
      options.speed_tolerance = speed;
      const Trajectory run = Simulate(*robot, nominal.x, nominal.u, 0.3, options);
      ASSERT_TRUE(run.status.ok()) << absolute << ", " << speed << ": " << run.status.message;
      EXPECT_EQ("ssoo", run.arcs.back().mode.Word(4));
      if (last.size() > 0) EXPECT_LT((run.FinalState() - last).norm(), 1e-6);
      last = run.FinalState();
    }
  }
}

/// Two fingertips hold a box in the air: its weight is their friction, and it stays. Where they
/// press less than the cone allows, it slips down from rest.
TEST(RobotsWithFriction, GripperHoldsABox) {
  const auto robot = LoadRobot(RobotFile("gripper_friction"));
  const NominalRun& nominal = robot->nominal();
  const Trajectory run = Simulate(*robot, nominal.x, nominal.u, 1, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.arcs.size());
  EXPECT_EQ("ssooo", run.arcs[0].mode.Word(5));
  EXPECT_LT(robot->Separation(run.FinalState(), nominal.x).cwiseAbs().maxCoeff(), 1e-10);
  ContactDynamics dynamics(*robot, nominal.u);
  dynamics.Evaluate(run.FinalState(), run.arcs[0].mode);
  ConstraintTerms terms;
  robot->Constraints(run.FinalState().head(robot->num_positions()),
                     run.FinalState().tail(robot->dof()), &terms);
  const auto& names = robot->description().velocities;
  const auto box_z = std::find(names.begin(), names.end(), "box_z") - names.begin();
  EXPECT_NEAR(0.5 * 9.81, terms.jacobian.col(box_z).dot(dynamics.force()), 1e-9);
  EXPECT_NEAR(10, dynamics.force()(0), 1e-9);
  BDerivativeOptions options;
  options.variables.parameters = ParameterIndices(robot->description(), {"friction"});
  const BDerivative B = DifferentiateOutcome(*robot, run, options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_TRUE(B(Vector::Unit(2 * robot->dof() + 1, 2 * robot->dof())).isZero(1e-12))
      << "what sticks does not feel how rough it is";
  const Vector loose = Vector::Map(std::vector<double>{3, -3}.data(), 2);  // μ 2 · 3 N < m g
  const Trajectory falls = Simulate(*robot, nominal.x, loose, 0.05, Tight());
  ASSERT_TRUE(falls.status.ok()) << falls.status.message;
  EXPECT_EQ("llooo", falls.arcs.front().mode.Word(5));
  const double drive = 9.81 - 2 * 0.6 * 3 / 0.5;  // g − 2 μ p/m
  EXPECT_NEAR(-0.05 * drive, falls.FinalState()(robot->num_positions() + box_z), 1e-8);
  EXPECT_EQ(Outcome::kNotPiecewiseLinear, DifferentiateOutcome(*robot, falls).status.outcome);
}

/// The quadruped, tilted and moving sideways, lands on one foot, which slides in space: derivatives
/// by state, friction and mass beside one-sided quotients, whose errors are of first order in α.
TEST(RobotsWithFriction, FootOfAQuadrupedSlides) {
  const auto robot = LoadRobot(RobotFile("quadruped_friction"));
  Vector w = Vector::Zero(36);
  w(2) = 0.07;
  w(3) = 0.06;
  w(4) = 0.1;
  w(18) = 0.5;
  w(19) = -0.8;
  const Vector x = robot->Perturb(robot->nominal().x, w);
  SimulateOptions options = Tight();
  options.max_events = 1;
  const Trajectory first = Simulate(*robot, x, robot->nominal().u, 0.5, options);
  ASSERT_EQ(1u, first.transitions.size()) << first.status.message;
  const double duration = first.transitions[0].t + 0.006;
  const Trajectory run = Simulate(*robot, x, robot->nominal().u, duration, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  ASSERT_EQ(1, run.arcs[1].mode.Size());
  const int foot = *run.arcs[1].mode.begin();
  ASSERT_EQ(Letter::kSlip, run.arcs[1].mode.LetterOf(foot));
  const Friction& friction = robot->friction()[static_cast<std::size_t>(foot)];
  ConstraintTerms terms;
  robot->Constraints(run.FinalState().head(19), run.FinalState().tail(18), &terms);
  EXPECT_GT((terms.jacobian.middleRows(friction.row, 2) * run.FinalState().tail(18)).norm(), 0.01);
  BDerivativeOptions derivative_options;
  derivative_options.tolerance = 1e-10;
  derivative_options.variables.parameters =
      ParameterIndices(robot->description(), {"friction", "trunk_mass"});
  const BDerivative B = DifferentiateOutcome(*robot, run, derivative_options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const SystemFactory again = [](const ParameterValues& values) {
    return LoadRobot(RobotFile("quadruped_friction"), values);
  };
  for (int j : {1, 2, 3, 5, 8, 19, 21, 25, 36, 37}) {
    const Vector direction = Vector::Unit(38, j);
    const QuotientReport report = CompareWithQuotients(
        *robot, again, derivative_options.variables, x, {{0}, {robot->nominal().u}}, duration,
        direction, B(direction), {1e-3, 1e-4, 1e-5}, Tight());
    const double size = 1 + B(direction).cwiseAbs().maxCoeff();
    EXPECT_LT(report.samples[2].error, 2e-3 * size) << j;
    EXPECT_TRUE(std::abs(report.slope - 1) < 0.1 || report.samples[0].error < 1e-5 * size)
        << j << ": slope " << report.slope << ", errors " << report.samples[0].error << ' '
        << report.samples[1].error << ' ' << report.samples[2].error;
  }
}

}  // namespace
}  // namespace contact_flow
