// SPDX-License-Identifier: BSD-3-Clause
// Derivatives of stiff motion that the implicit method has made: its steps are far longer than the
// fast tangents, which collocation resolves by itself.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <sstream>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/derivative/variation.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/hard_quadruped.h"

namespace contact_flow {
namespace {

/// A damped slide that a force of time pushes, m ẍ = F(t) − k x − c ẋ, by the instant at which it
/// does, with m, F, k and c in any unit of mass. The unit of the clock's tangents is none of mass:
/// beside 2^-24 kg derivatives were 0.
TEST(StiffMotion, DerivativesByTimeDoNotDependOnTheUnitOfMass) {
  std::vector<Vector> columns;
  for (const double unit : {1.0, 0x1p-24, 0x1p-30, 0x1p30}) {
    std::ostringstream urdf, yaml;
    urdf.precision(17);
    yaml.precision(17);
    urdf << "<robot name='r'><link name='base'/><link name='l'><inertial><mass value='" << unit
         << "'/><inertia ixx='" << unit << "' iyy='" << unit << "' izz='" << unit
         << "' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='x' type='prismatic'>"
         << "<parent link='base'/><child link='l'/><axis xyz='1 0 0'/>"
         << "<limit lower='-3' upper='3' effort='1' velocity='1'/></joint></robot>";
    yaml << "base: fixed\nefforts: {push: {kind: timed_force, link: l, point: [0, 0, 0], force: ["
         << unit << ", 0, 0], reference: {times: [0.13, 0.3, 0.43], values: [-0.23, -0.6, -0.37], "
         << "kind: cubic}}, damper: {kind: joint_spring, joint: x, stiffness: " << 2500 * unit
         << ", damping: " << 3e5 * unit << "}}\n";
    const auto robot = MakeRobot({urdf.str(), yaml.str()});
    const Vector &x = robot->nominal().x, &u = robot->nominal().u;
    const Trajectory run = Simulate(*robot, x, u, 0.2, With(IntegrationMethod::kImplicit, 1e-9));
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    const BDerivative B = DifferentiateOutcome(*robot, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    columns.push_back(B(Vector::Unit(4, 1)));
    if (unit != 1) continue;
    const auto at = [&](double clock) {
      Vector moved = x;
      moved(1) += clock;
      return Simulate(*robot, moved, u, 0.2, With(IntegrationMethod::kImplicit, 1e-13))
          .FinalState();
    };
    constexpr double kStep = 1e-3;
    const Vector quotient = (at(kStep) - at(-kStep)) / (2 * kStep);
    EXPECT_LT((columns[0] - quotient).lpNorm<Eigen::Infinity>(), 1e-9) << quotient.transpose();
  }
  EXPECT_GT(std::abs(columns[0](0)), 4e-7);
  for (const Vector& column : columns) {
    EXPECT_LT((column - columns[0]).lpNorm<Eigen::Infinity>(), 1e-10) << column.transpose();
  }
}

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
