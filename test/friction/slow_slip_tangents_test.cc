// SPDX-License-Identifier: BSD-3-Clause
// Tangents where slips in space begin slowly: the robot moves at 1 m/s, its feet slip at 1e-9 m/s
// at first, so that their direction is known to 1e-7, and turn at up to 1e10/s. What that turns is
// beside what other contacts hold.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/variation.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

/// The quadruped stretches its legs at 0.05 s; its feet slip before they lift. Steps that followed
/// the turns, or their rounding, were 1539 to 65752 along one arc.
TEST(SlowSlip, OfARobotHasTangentsOfFewSteps) {
  const auto robot = LoadRobot(RobotFile("quadruped_friction"));
  Vector stretched = robot->nominal().u;
  for (int leg = 0; leg < 4; ++leg) stretched.segment<2>(3 * leg + 1) << 1, -0.6;
  const InputSchedule inputs = {{0, 0.05}, {robot->nominal().u, stretched}};
  for (const double tolerance : {1e-9, 1.5e-11}) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    const Trajectory run = Simulate(*robot, robot->nominal().x, inputs, 0.13, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    int slipping = 0;
    for (const Arc& arc : run.arcs) {
      ContactDynamics dynamics(*robot, arc.u);
      slipping += arc.mode.Word(4).find('l') != std::string::npos;
      Matrix other;
      for (const double asked : {1e-7, 1e-9, 1e-11, 1e-12}) {
        VariationStatistics statistics;
        const Matrix phi = PropagateArc(&dynamics, arc, asked, &statistics);
        EXPECT_LT(statistics.steps + statistics.rejected_steps, 300)
            << "at t = " << arc.t_begin << " s, tolerances " << tolerance << ", " << asked;
        const double size = phi.cwiseAbs().maxCoeff();
        if (other.size() > 0) EXPECT_LT((phi - other).cwiseAbs().maxCoeff(), 1e-6 * size);
        other = phi;
        // Φ F(x(t₀)) = F(x(t₁)), in tangents (δq, δv).
        const int d = robot->dof();
        const auto field = [&](const Vector& x) {
          dynamics.Evaluate(x, arc.mode);
          return (Vector(2 * d) << x.tail(d), dynamics.acceleration()).finished();
        };
        const Vector first = field(arc.x_begin), last = field(arc.x_end);
        EXPECT_LT((phi.topLeftCorner(2 * d, 2 * d) * first - last).cwiseAbs().maxCoeff(),
                  1e-6 * last.cwiseAbs().maxCoeff())
            << "at t = " << arc.t_begin << " s";
      }
    }
    EXPECT_GE(slipping, 3);
  }
}

/// A sole begins to slip at 0.2265 s, its rate growing from zero, so that it turns at up to 1e17/s;
/// two others stick, and have to in all tangents. They slipped at 4e-5, of tangents of size 1, and
/// the outcome's derivative was off by 1e-4 where 1e-9 was told.
TEST(SlowSlip, BesideItWhatIsHeldIsHeld) {
  const auto robot = LoadRobot(CONTACT_FLOW_TEST_DATA "/friction/table_on_soles.yaml");
  const Vector &x = robot->nominal().x, &u = robot->nominal().u;
  const double duration = 0.2267;
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  options.dense = true;
  const auto run_from = [&](const Vector& start) {
    return Simulate(*robot, start, u, duration, options);
  };
  const Trajectory run = run_from(x);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ("ssl", run.arcs.back().mode.Word(5).substr(0, 3));
  Vector w(2 * robot->dof());
  for (int i = 0; i < w.size(); ++i) w(i) = std::sin(1 + 2.3 * i);
  for (const double tolerance : {1e-8, 1e-10, 1e-12}) {
    BDerivativeOptions asked;
    asked.tolerance = tolerance;
    const BDerivative B = DifferentiateOutcome(*robot, run, asked);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    const Vector b = B(w);
    const double step = 1e-5;
    const Trajectory ahead = run_from(robot->Perturb(x, step * w));
    const Trajectory behind = run_from(robot->Perturb(x, -step * w));
    ASSERT_TRUE(ahead.status.ok() && behind.status.ok());
    const Vector quotient = robot->Separation(ahead.FinalState(), behind.FinalState()) / (2 * step);
    EXPECT_LT((b - quotient).norm(), 1e-6 * b.norm()) << "tolerance " << tolerance;
  }
}

}  // namespace
}  // namespace contact_flow
