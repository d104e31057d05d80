// SPDX-License-Identifier: BSD-3-Clause
// A grip that is loosened in a step: both fingertips begin to slip in space at one instant.
#include <gtest/gtest.h>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

/// Beside central quotients, which are off by up to 5e-4 at this step, 52 times the step.
/// The tips push by 10 N each and hold the box, then by 6.4 and 6.3 N, and it slides down, turning.
TEST(LoosenedGrip, HasTheDerivativeOfTwoSlipsThatBegin) {
  const auto gripper =
      LoadRobot(RobotFile("gripper_friction"), {{"friction", 0.66}, {"box_mass", 0.9}});
  const InputSchedule grip{{0.0, 0.1}, {test::Entries({10, -10}), test::Entries({6.370, -6.298})}};
  const Vector x = gripper->nominal().x;
  const int d = gripper->dof();
  const auto outcome = [&](const Vector& start, double tolerance) {
    SimulateOptions options = test::AtTolerance(tolerance);
    options.dense = true;
    return Simulate(*gripper, start, grip, 0.14, options);
  };
  for (const double tolerance : {1e-9, 1e-12}) {
    const Trajectory run = outcome(x, tolerance);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(2u, run.arcs.size());
    ASSERT_EQ("ssooo", run.arcs[0].mode.Word(5));
    ASSERT_EQ("llooo", run.arcs[1].mode.Word(5));
    const BDerivative B = DifferentiateOutcome(*gripper, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    EXPECT_LT(B.trust.derivative_error, 1e-4);
    const double step = 1e-5;
    for (int k = 0; k < 2 * d; ++k) {
      const Vector w = ProjectAdmissible(*gripper, x, run.arcs[0].mode, Vector::Unit(2 * d, k));
      const Trajectory up = outcome(gripper->Perturb(x, step * w), 1e-12);
      const Trajectory down = outcome(gripper->Perturb(x, -step * w), 1e-12);
      ASSERT_TRUE(up.status.ok() && down.status.ok()) << up.status.message << down.status.message;
      const Vector exact = gripper->Separation(up.FinalState(), down.FinalState()) / (2 * step);
      EXPECT_LT((B(w) - exact).cwiseAbs().maxCoeff(), 1e-3)
          << gripper->description().velocities[static_cast<std::size_t>(k % d)] << " " << tolerance;
    }
  }
}

}  // namespace
}  // namespace contact_flow
