// SPDX-License-Identifier: BSD-3-Clause
// Derivatives of stiff motion that the implicit method has made: its steps are far longer than the
// fast tangents, which collocation resolves by itself.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/hard_quadruped.h"

namespace contact_flow {
namespace {

/// A touchdown and what follows it: columns of the derivative by state and parameters beside those
/// of an explicit run at 1e-12.
TEST(StiffMotion, DerivativesAreThoseOfTheExplicitMethod) {
  for (double gain : {10, 100}) {
    const auto robot = HardQuadruped(gain);
    const Vector x = Tilted(*robot), u = robot->nominal().u;
    BDerivativeOptions options;
    options.tolerance = 1e-10;
    options.variables.parameters =
        ParameterIndices(robot->description(), {"trunk_mass", "stiffness"});
    const double duration = 0.1;
    const auto columns = [&](const Trajectory& run) {
      EXPECT_TRUE(run.status.ok()) << run.status.message;
      EXPECT_EQ(1u, run.transitions.size());
      const BDerivative B = DifferentiateOutcome(*robot, run, options);
      EXPECT_TRUE(B.status.ok()) << B.status.message;
      Matrix all(36, 38);
      for (int j = 0; j < 38; ++j) all.col(j) = B(Vector::Unit(38, j));
      return all;
    };
    const Matrix exact =
        columns(Simulate(*robot, x, u, duration, With(IntegrationMethod::kExplicit, 1e-12)));
    for (auto method : {IntegrationMethod::kImplicit, IntegrationMethod::kAutomatic}) {
      const Trajectory run = Simulate(*robot, x, u, duration, With(method, 1e-9));
      EXPECT_GT(run.statistics.implicit_steps, 0);
      const Matrix error = columns(run) - exact;
      // Errors of the state of 1e-9, times second derivatives of up to gain·40/s a second.
      EXPECT_LT(error.cwiseAbs().maxCoeff(), 1e-6 * exact.cwiseAbs().maxCoeff()) << gain;
    }
  }
}

/// And beside one-sided quotients of implicit runs, whose errors are of first order in α, and some
/// thousands times α where the touchdown comes earlier.
TEST(StiffMotion, DerivativesAreThoseOfQuotients) {
  const auto robot = HardQuadruped(10);
  const Vector x = Tilted(*robot), u = robot->nominal().u;
  const double duration = 0.1;
  const SimulateOptions tight = With(IntegrationMethod::kImplicit, 1e-12);
  const Trajectory run = Simulate(*robot, x, u, duration, tight);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  BDerivativeOptions options;
  options.tolerance = 1e-10;
  options.variables.parameters = ParameterIndices(robot->description(), {"trunk_mass"});
  const BDerivative B = DifferentiateOutcome(*robot, run, options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const SystemFactory again = [](const ParameterValues& values) {
    ParameterValues all = {{"stiffness", 800}, {"damping", 30}};
    for (const auto& value : values) all[value.first] = value.second;
    return LoadRobot(RobotFile("quadruped"), all);
  };
  for (int j : {2, 3, 4, 20, 22, 36}) {
    const Vector direction = Vector::Unit(37, j);
    const QuotientReport report =
        CompareWithQuotients(*robot, again, options.variables, x, {{0}, {u}}, duration, direction,
                             B(direction), {1e-4, 1e-5, 1e-6}, tight);
    const double size = 1 + B(direction).cwiseAbs().maxCoeff();
    EXPECT_LT(report.samples[2].error, 2e-3 * size) << j;
    EXPECT_TRUE(std::abs(report.slope - 1) < 0.1 || report.samples[0].error < 1e-5 * size)
        << j << ": slope " << report.slope << ", errors " << report.samples[0].error << ' '
        << report.samples[1].error << ' ' << report.samples[2].error;
  }
}

}  // namespace
}  // namespace contact_flow
