// SPDX-License-Identifier: BSD-3-Clause
// Jacobians of robots whose feet stick, beside central quotients of the dynamics.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <string>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

constexpr double kQuotientStep = 1e-5;

struct Values {
  Vector acceleration, force;
};

Values ValuesAt(ContactDynamics* dynamics, const Vector& x, ContactMode mode) {
  dynamics->Evaluate(x, mode);
  return {dynamics->acceleration(), dynamics->force()};
}

/// The quadruped on some of its feet, moved at random, by state, an input and parameters: all
/// columns. Quotients miss h² times third derivatives and 1e-15/h, 1e-6 of the largest entry.
TEST(StickingJacobian, IsThatOfTheDynamics) {
  const auto robot = LoadRobot(RobotFile("quadruped_friction"));
  const int d = robot->dof(), inputs = robot->num_inputs();
  Variables variables;
  variables.inputs = true;
  variables.parameters = ParameterIndices(robot->description(), {"trunk_mass", "stiffness"});
  const auto parameters = static_cast<Eigen::Index>(variables.parameters.size());
  const Vector u = robot->nominal().u;
  ContactDynamics dynamics(*robot, u, variables);
  std::srand(5);
  for (int feet : {1, 2, 3, 4}) {
    ContactMode mode;
    for (int i = 0; i < feet; ++i) mode.Set(i, Letter::kStick);
    const Vector x = robot->Perturb(robot->nominal().x, 0.2 * Vector::Random(2 * d));
    dynamics.Differentiate(x, mode);
    const Matrix acceleration = dynamics.acceleration_jacobian(), force = dynamics.force_jacobian();
    const double size = acceleration.cwiseAbs().maxCoeff(),
                 force_size = force.cwiseAbs().maxCoeff();
    const auto expect = [&](Eigen::Index column, const Values& ahead, const Values& back,
                            double step) {
      const Vector by = (ahead.acceleration - back.acceleration) / (2 * step),
                   force_by = (ahead.force - back.force) / (2 * step);
      EXPECT_LE((by - acceleration.col(column)).cwiseAbs().maxCoeff(), 1e-6 * size) << column;
      EXPECT_LE((force_by - force.col(column)).cwiseAbs().maxCoeff(), 1e-6 * force_size) << column;
    };
    ContactDynamics plain(*robot, u);
    for (int j = 0; j < 2 * d; ++j) {
      const Vector w = kQuotientStep * Vector::Unit(2 * d, j);
      expect(j, ValuesAt(&plain, robot->Perturb(x, w), mode),
             ValuesAt(&plain, robot->Perturb(x, -w), mode), kQuotientStep);
    }
    for (int j = 0; j < inputs; ++j) {
      const Vector w = kQuotientStep * Vector::Unit(inputs, j);
      ContactDynamics ahead(*robot, u + w), back(*robot, u - w);
      expect(2 * d + j, ValuesAt(&ahead, x, mode), ValuesAt(&back, x, mode), kQuotientStep);
    }
    for (Eigen::Index j = 0; j < parameters; ++j) {
      const std::string name = j == 0 ? "trunk_mass" : "stiffness";
      const double value = robot->description().parameters[variables.parameters[j]].value;
      const double step = kQuotientStep * value;
      const auto with = [&](double moved) {
        const auto other = LoadRobot(RobotFile("quadruped_friction"), {{name, moved}});
        ContactDynamics moved_dynamics(*other, u);
        return ValuesAt(&moved_dynamics, x, mode);
      };
      expect(2 * d + inputs + j, with(value + step), with(value - step), step);
    }
  }
}

}  // namespace
}  // namespace contact_flow
