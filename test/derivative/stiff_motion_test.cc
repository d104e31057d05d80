// SPDX-License-Identifier: BSD-3-Clause
// Derivatives of stiff motion that the implicit method has made: its steps are far longer than the
// fast tangents, which collocation resolves by itself.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/derivative/variation.h"
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

/// In flight with the trunk turning: the tangents of one arc, by few steps, are the product of
/// those of thousands, each short beside every decay. Entries compare by the largest of their
/// block, δq or δv by δq or δv.
TEST(StiffMotion, TangentsTakeFewSteps) {
  for (const double gain : {10, 100}) {
    const auto robot = HardQuadruped(gain);
    Vector x = robot->nominal().x;
    for (int j = 0; j < 18; ++j) x(19 + j) = 0.3 * std::sin(j + 1.0);
    const Vector u = robot->nominal().u;
    const double duration = 0.1;
    const int pieces = static_cast<int>(100 * gain);
    std::vector<double> times;
    for (int k = 0; k < pieces; ++k) times.push_back(duration * k / pieces);
    const SimulateOptions tight = With(IntegrationMethod::kImplicit, 1e-12);
    const Trajectory one = Simulate(*robot, x, u, duration, tight);
    const Trajectory many = Simulate(
        *robot, x, InputSchedule{times, std::vector<Vector>(times.size(), u)}, duration, tight);
    ASSERT_EQ(1u, one.arcs.size());
    ASSERT_EQ(times.size(), many.arcs.size());
    ContactDynamics dynamics(*robot, u);
    Matrix exact = Matrix::Identity(36, 36);
    for (const Arc& arc : many.arcs) exact = PropagateArc(&dynamics, arc, 1e-13) * exact;
    for (const double tolerance : {1e-6, 1e-9}) {
      VariationStatistics statistics;
      const Matrix error = PropagateArc(&dynamics, one.arcs[0], tolerance, &statistics) - exact;
      EXPECT_LT(statistics.steps + statistics.rejected_steps, 40) << gain;
      for (int row : {0, 18}) {
        for (int column : {0, 18}) {
          const double relative = error.block(row, column, 18, 18).cwiseAbs().maxCoeff() /
                                  exact.block(row, column, 18, 18).cwiseAbs().maxCoeff();
          EXPECT_LT(relative, statistics.error_estimate) << gain << ' ' << row << ' ' << column;
        }
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
