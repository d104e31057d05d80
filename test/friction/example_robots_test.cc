// SPDX-License-Identifier: BSD-3-Clause
// The robots of docs/examples.md do what the page says.
#include <gtest/gtest.h>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

/// z of the robot's own upright axis, from its quaternion.
double Upright(const Vector& x) { return 1 - 2 * (x(4) * x(4) + x(5) * x(5)); }

/// B(w) of the nominal run beside one-sided quotients along each of these directions, with
/// parameters behind the state.
void ExpectQuotients(const std::string& name, const std::vector<std::string>& parameters,
                     const std::vector<int>& directions) {
  const auto robot = LoadRobot(RobotFile(name));
  const NominalRun& nominal = robot->nominal();
  SimulateOptions tight;
  tight.relative_tolerance = tight.absolute_tolerance = 1e-11;
  const Trajectory run = Simulate(*robot, nominal.x, nominal.u, nominal.duration, tight);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  BDerivativeOptions options;
  options.variables.parameters = ParameterIndices(robot->description(), parameters);
  const BDerivative B = DifferentiateOutcome(*robot, run, options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const SystemFactory again = [&](const ParameterValues& values) {
    return LoadRobot(RobotFile(name), values);
  };
  const int size = 2 * robot->dof() + static_cast<int>(parameters.size());
  for (int j : directions) {
    for (double sign : {1., -1.}) {
      const Vector w = sign * Vector::Unit(size, j);
      const QuotientReport report =
          CompareWithQuotients(*robot, again, options.variables, nominal.x, {{0}, {nominal.u}},
                               nominal.duration, w, B(w), {1e-5, 1e-6}, tight);
      // Errors are of first order in α; the runs' own leave 1e-11 / α, a few 1e-6 at most.
      const double coarse = report.samples[0].error, fine = report.samples[1].error;
      EXPECT_LT(fine, 0.15 * coarse + 5e-6) << name << ' ' << j << ' ' << sign;
      EXPECT_LT(fine, 1e-3 * (1 + B(w).cwiseAbs().maxCoeff())) << name << ' ' << j << ' ' << sign;
    }
  }
}

/// One finger after the other, both feet off the table, and in the air friction bears the weight.
TEST(ExampleRobots, LifterHoldsTheBox) {
  const auto robot = LoadRobot(RobotFile("lifter"));
  const NominalRun& nominal = robot->nominal();
  const Trajectory run = Simulate(*robot, nominal.x, nominal.u, nominal.duration);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(5u, run.arcs.size());
  EXPECT_EQ("osll", run.arcs[1].mode.Word(4));
  EXPECT_EQ("ssll", run.arcs[2].mode.Word(4));
  EXPECT_EQ("ssoo", run.arcs[4].mode.Word(4));
  ContactDynamics dynamics(*robot, nominal.u);
  dynamics.Evaluate(run.FinalState(), run.arcs[4].mode);
  ConstraintTerms terms;
  robot->Constraints(run.FinalState().head(robot->num_positions()),
                     run.FinalState().tail(robot->dof()), &terms);
  const Vector push = terms.jacobian.transpose() * dynamics.force();
  EXPECT_NEAR(-(0.5 + 2 * 0.02) * 9.81, push(1), 0.02) << "box_y points down; it all but rests";
  EXPECT_NEAR(-nominal.x(1) + 0.15, -run.FinalState()(1), 5e-3);
}

/// box_x, a slide, the velocity of the lift; friction and mass.
TEST(ExampleRobots, LifterHasItsDerivative) {
  ExpectQuotients("lifter", {"friction", "box_mass"}, {0, 7, 14, 18, 19});
}

TEST(ExampleRobots, WiperSlipsSticksAndHasItsDerivative) {
  const auto robot = LoadRobot(RobotFile("wiper"));
  const Trajectory run = Simulate(*robot, robot->nominal().x, robot->nominal().u, 4);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  std::string words;
  for (const auto& arc : run.arcs) words += arc.mode.Word(1);
  EXPECT_EQ("o+s-s+s-", words);
  ExpectQuotients("wiper", {"friction", "stiffness"}, {0, 2, 6});
}

/// Pushed by the same 30 N s, one falls and the other does not.
TEST(ExampleRobots, FeedbackKeepsTheTrotOnItsFeet) {
  const auto run = [](const char* name) {
    const auto robot = LoadRobot(RobotFile(name));
    return Simulate(*robot, robot->nominal().x, robot->nominal().u, 1.25);
  };
  const Trajectory open = run("quadruped_trot"), closed = run("quadruped_trot_feedback");
  ASSERT_TRUE(open.status.ok()) << open.status.message;
  ASSERT_TRUE(closed.status.ok()) << closed.status.message;
  EXPECT_LT(Upright(open.FinalState()), 0.2);
  EXPECT_GT(Upright(closed.FinalState()), 0.95);
  EXPECT_GT(closed.FinalState()(2), 0.3) << "of its height of 0.34 m";
}

/// It lands, is pushed, lifts its toes when it swings back, and stands at last.
TEST(ExampleRobots, HumanoidStands) {
  const auto robot = LoadRobot(RobotFile("humanoid"));
  const Trajectory run = Simulate(*robot, robot->nominal().x, robot->nominal().u, 2);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(5u, run.arcs.size());
  const char* words[] = {"oooooooo", "ssoossoo", "ssssssss", "ssoossoo", "ssssssss"};
  for (std::size_t k = 0; k < 5; ++k) EXPECT_EQ(words[k], run.arcs[k].mode.Word(8));
  EXPECT_GT(Upright(run.FinalState()), 0.99);
}

}  // namespace
}  // namespace contact_flow
