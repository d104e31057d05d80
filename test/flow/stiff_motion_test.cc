// SPDX-License-Identifier: BSD-3-Clause
// Stiff robots by the implicit method: the events of the explicit one, at a small part of its work.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "contact_flow/dynamics/impact.h"
#include "contact_flow/flow/flow.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/hard_quadruped.h"

namespace contact_flow {
namespace {

constexpr IntegrationMethod kExplicit = IntegrationMethod::kExplicit,
                            kImplicit = IntegrationMethod::kImplicit,
                            kAutomatic = IntegrationMethod::kAutomatic;

/// Right-hand sides, a Jacobian counted as five (measured 4.5), and its factors as three more.
double Work(const Trajectory& run) {
  return static_cast<double>(run.statistics.field_evaluations + 8 * run.statistics.jacobians);
}

void ExpectSameEvents(const Trajectory& expected, const Trajectory& run, double seconds) {
  ASSERT_TRUE(expected.status.ok()) << expected.status.message;
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(expected.transitions.size(), run.transitions.size());
  for (std::size_t k = 0; k < run.transitions.size(); ++k) {
    EXPECT_EQ(expected.transitions[k].mode_after, run.transitions[k].mode_after) << k;
    EXPECT_NEAR(expected.transitions[k].t, run.transitions[k].t, seconds) << k;
  }
}

/// At tolerance 1e-8 the instants of 14 events are those of the explicit method at 1e-12 to 1e-10
/// s, gaps being closed at some cm/s; and what is left at the end agrees to the tolerance.
TEST(StiffMotion, EventsAreThoseOfTheExplicitMethod) {
  const auto robot = HardQuadruped(10);
  const Vector x = Tilted(*robot), u = robot->nominal().u;
  const Trajectory exact = Simulate(*robot, x, u, 0.3, With(kExplicit, 1e-12));
  const Trajectory run = Simulate(*robot, x, u, 0.3, With(kImplicit, 1e-8));
  EXPECT_EQ(14u, run.transitions.size());
  ExpectSameEvents(exact, run, 1e-10);
  EXPECT_LT(robot->Separation(run.FinalState(), exact.FinalState()).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_EQ(run.statistics.steps, run.statistics.implicit_steps);
  EXPECT_EQ(kImplicit, run.method);
  for (const Arc& arc : run.arcs) {
    EXPECT_EQ(static_cast<long>(arc.dense.NumSteps()), arc.implicit_steps);
  }
  const Trajectory automatic = Simulate(*robot, x, u, 0.3, With(kAutomatic, 1e-8));
  ExpectSameEvents(exact, automatic, 1e-10);
}

/// The motion between the nodes is as good as at them.
TEST(StiffMotion, TheDenseOutputHasTheTolerance) {
  const auto robot = HardQuadruped(10);
  const Vector u = robot->nominal().u;
  const Trajectory exact = Simulate(*robot, robot->nominal().x, u, 0.2, With(kExplicit, 1e-12));
  const Trajectory run = Simulate(*robot, robot->nominal().x, u, 0.2, With(kImplicit, 1e-8));
  double worst = 0;
  for (double t = 0; t < 0.2; t += 0.0003) {
    worst = std::max(worst, robot->Separation(run.State(t), exact.State(t)).cwiseAbs().maxCoeff());
  }
  // Errors of a step are within the tolerance, of velocities up to 3 rad/s; a few add up.
  EXPECT_LT(worst, 1e-7);
}

/// Servos 10 and 100 times as hard take at least 5 and 20 times the work by the explicit method.
TEST(StiffMotion, TakesASmallPartOfTheWork) {
  for (const auto& [gain, ratio] : {std::pair{10, 5}, std::pair{100, 20}}) {
    const auto robot = HardQuadruped(gain);
    const NominalRun& nominal = robot->nominal();
    const auto run = [&](IntegrationMethod method) {
      return Simulate(*robot, nominal.x, nominal.u, 1, With(method, 1e-8));
    };
    const Trajectory of_explicit = run(kExplicit), of_implicit = run(kImplicit),
                     automatic = run(kAutomatic);
    ExpectSameEvents(of_explicit, of_implicit, 1e-10);
    ExpectSameEvents(of_explicit, automatic, 1e-10);
    EXPECT_GT(Work(of_explicit), ratio * Work(of_implicit)) << gain;
    EXPECT_GT(Work(of_explicit), ratio * Work(automatic)) << gain;
    EXPECT_GT(automatic.statistics.implicit_steps, 0);
    EXPECT_LT(automatic.statistics.implicit_steps, automatic.statistics.steps)
        << "transients are not stiff";
  }
}

/// What is not stiff stays explicit, to the bit.
TEST(StiffMotion, AutomaticIsExplicitWhereNothingIsStiff) {
  const auto robot = LoadRobot(RobotFile("soft_biped"));
  const NominalRun& nominal = robot->nominal();
  const Trajectory plain = Simulate(*robot, nominal.x, nominal.u, nominal.duration);
  SimulateOptions options;
  options.method = kAutomatic;
  const Trajectory run = Simulate(*robot, nominal.x, nominal.u, nominal.duration, options);
  EXPECT_EQ(0, run.statistics.implicit_steps);
  EXPECT_EQ(plain.FinalState(), run.FinalState());
  EXPECT_EQ(kAutomatic, run.method);
}

/// Pushed by 20 N·s, the quadruped with friction slides, and two of its feet creep to their rest:
/// slip in space is the stiffer the slower it is, and explicit steps take microseconds.
TEST(StiffMotion, APushedQuadrupedComesToRest) {
  const auto robot = LoadRobot(RobotFile("quadruped_friction"));
  const Vector u = robot->nominal().u;
  Vector x = Simulate(*robot, robot->nominal().x, u, 8).FinalState();
  SimulateOptions options = With(kImplicit, 1e-9);
  options.max_steps = 5000;
  const Vector push = 20 * Vector::Unit(18, 0);
  x.tail(18) = PushedVelocity(*robot, x, push, options.gap_tolerance, options.impact_law);
  const Trajectory run = Simulate(*robot, x, u, 12, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_EQ("ssss", run.arcs.back().mode.Word(4));
  EXPECT_LT(run.arcs.back().t_begin, 2);
  // What is left then is motion at 4/s and slower: from some cm/s at 1.5 s on.
  EXPECT_LT(run.FinalState().tail(18).cwiseAbs().maxCoeff(), 1e-6);
  options.method = kAutomatic;
  const Trajectory automatic = Simulate(*robot, x, u, 12, options);
  ASSERT_TRUE(automatic.status.ok()) << automatic.status.message;
  EXPECT_EQ("ssss", automatic.arcs.back().mode.Word(4));
  EXPECT_LT(robot->Separation(run.FinalState(), automatic.FinalState()).cwiseAbs().maxCoeff(),
            1e-5);
}

/// The motion up to an instant does not depend, to the bit, on what is decided for later; and a
/// proposal may be made again.
TEST(StiffMotion, IsCausal) {
  const auto robot = HardQuadruped(10);
  const Vector x = Tilted(*robot), u = robot->nominal().u;
  for (IntegrationMethod method : {kImplicit, kAutomatic}) {
    const SimulateOptions options = With(method, 1e-8);
    const Vector other = u + Vector::Constant(u.size(), 0.1);
    const Trajectory one = Simulate(*robot, x, {{0, 0.12}, {u, other}}, 0.2, options);
    const Trajectory two = Simulate(*robot, x, {{0, 0.12}, {u, u}}, 0.2, options);
    ASSERT_TRUE(one.status.ok() && two.status.ok());
    std::size_t arcs = 0;
    for (; one.arcs[arcs].t_end < 0.12; ++arcs) {
      EXPECT_EQ(one.arcs[arcs].t_end, two.arcs[arcs].t_end);
      EXPECT_EQ(one.arcs[arcs].x_end, two.arcs[arcs].x_end);
    }
    EXPECT_GT(arcs, 1u);
    EXPECT_EQ(one.arcs[arcs].x_end, two.arcs[arcs].x_end);

    Flow once(*robot, 0, x, ContactMode(), u, options);
    Flow twice(*robot, 0, x, ContactMode(), u, options);
    while (once.t() < 0.15) {
      ASSERT_TRUE(once.Propose(0.2) && twice.Propose(0.2) && twice.Propose(0.2));
      once.Accept();
      twice.Accept();
      ASSERT_EQ(once.t(), twice.t());
      ASSERT_EQ(once.x(), twice.x());
    }
  }
}

}  // namespace
}  // namespace contact_flow
