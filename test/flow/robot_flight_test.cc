// SPDX-License-Identifier: BSD-3-Clause
// What free flight keeps: energy, and the momenta that gravity leaves alone.
#include <gtest/gtest.h>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/rigid_body/mass_matrix.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

struct Quantities {
  double energy;          // kinetic, of gravity, of springs
  Vec3<double> momentum;  // in world axes
  Vec3<double> spin;      // angular momentum about the centre of mass
};

Quantities Measure(const RobotSystem& system, const Vector& x) {
  const RigidBodyTree& tree = system.robot().model.tree;
  const int nq = system.num_positions(), n = system.dof();
  const Vector q = x.head(nq), v = x.tail(n), u = system.nominal().u;
  TreeState<double> state(tree);
  UpdatePositions(tree, q.data(), &state);
  UpdateVelocities(tree, v.data(), &state);
  UpdateInertias(tree, &state);
  Quantities sum{0, Vec3<double>::Zero(), Vec3<double>::Zero()};
  Spatial<double> momentum = Spatial<double>::Zero();
  Vec3<double> first = Vec3<double>::Zero();
  double mass = 0;
  for (const TreeState<double>::Body& body : state.body) {
    const Spatial<double> p = body.inertia * body.velocity;
    momentum += p;
    first += body.inertia.moment;
    mass += body.inertia.mass;
    sum.energy += 0.5 * Dot(p, body.velocity);
  }
  const Vec3<double> com = first / mass;
  sum.energy -= mass * tree.gravity().dot(com + state.body.front().reference);
  sum.momentum = momentum.lin;
  sum.spin = momentum.ang - Cross(com, momentum.lin);
  for (const auto& effort : system.robot().efforts) {  // servos and springs at joints
    const ElementParts& parts = effort->parts;
    const double rest = parts.inputs.empty() ? parts.numbers[2].value : u(parts.inputs[0]);
    const double stretch = q(parts.joints[0].q) - rest;
    sum.energy += 0.5 * parts.numbers[0].value * stretch * stretch;
  }
  return sum;
}

class RobotFlight : public testing::TestWithParam<const char*> {};

/// Without damping, from a tumbling start high up. The integrator keeps each of ~1e2 steps to 1e-12
/// of states of order 10, energies are of order 1e3: 1e-8 of rounding and integration error.
TEST_P(RobotFlight, KeepsEnergyAndMomenta) {
  RobotDescription robot = ParseRobot(ReadRobotTexts(RobotFile(GetParam())));
  for (const auto& effort : robot.efforts) effort->parts.numbers[1].value = 0;  // damping
  robot.parameters.clear();
  const RobotSystem system(std::move(robot), {});
  const SystemDescription& names = system.description();
  Vector x = system.nominal().x;
  const int nq = system.num_positions(), n = system.dof();
  for (int i = 0; i < nq; ++i) {
    if (names.coordinates[i] == "base_z") x(i) = 20;
  }
  for (int j = 0; j < n; ++j) x(nq + j) = std::sin(1.0 + 3.0 * j);
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  const Trajectory run = Simulate(system, x, system.nominal().u, 0.3, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  for (const Transition& transition : run.transitions) {
    ASSERT_TRUE(transition.activated.Empty()) << "it hits a stop of its own joints";
  }
  const Vector y = run.FinalState();
  const Quantities before = Measure(system, x), after = Measure(system, y);
  EXPECT_NEAR(before.energy, after.energy, 1e-8);
  const bool planar = names.coordinates[1] == "base_z";
  for (int k = 0; k < 2; ++k) {
    if (planar && k == 1) continue;  // the plane holds it
    EXPECT_NEAR(before.momentum(k), after.momentum(k), 1e-9);
  }
  for (int k = 0; k < 3; ++k) {
    if (planar && k != 1) continue;
    EXPECT_NEAR(before.spin(k), after.spin(k), 1e-9);
  }
  EXPECT_LE(system.space().NormError(y.head(nq)), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Robots, RobotFlight,
                         testing::Values("quadruped", "compliant_quadruped", "planar_biped"),
                         [](const testing::TestParamInfo<const char*>& info) {
                           return std::string(info.param);
                         });

}  // namespace
}  // namespace contact_flow
