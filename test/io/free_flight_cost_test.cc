// SPDX-License-Identifier: BSD-3-Clause
// What rounding alone makes of the tangents of free motion takes no steps.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/flow/simulate.h"
#include "test/io/moving_robots.h"

namespace contact_flow {
namespace {

using test::Make;

/// Evaluations of DF that the gradient of ½ |x(T)|² takes.
long JacobiansOf(const RobotSystem& system, const Trajectory& run,
                 const BDerivativeOptions& options = {}) {
  QuadraticCost cost;
  cost.weight = Vector::Ones(system.state_size());
  const CostGradient gradient = DifferentiateCost(system, run, cost.Make(system), options);
  EXPECT_TRUE(gradient.status.ok()) << gradient.status.message;
  return gradient.statistics.jacobians;
}

std::string FallingBody(int number, double mass, double inertia) {
  const std::string name = "b" + std::to_string(number), m = std::to_string(mass),
                    i = std::to_string(inertia);
  return "<link name='" + name + "'><inertial><mass value='" + m + "'/><inertia ixx='" + i +
         "' iyy='" + i + "' izz='" + i +
         "' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='" + name +
         "' type='planar'><parent link='w'/><child link='" + name +
         "'/><axis xyz='0 1 0'/></joint>";
}

/// Bodies that turn while they fall: v̇ is the same everywhere, and what is computed of Dv̇ is noise.
TEST(FreeFlightCost, OfBodiesInThePlane) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 40; ++trial) {
    const int count = 1 + trial % 3;
    std::string links, positions, velocities;
    for (int k = 0; k < count; ++k) {
      links += FallingBody(k, 0.01 + 2 * unit(random), 1e-4 + 0.02 * unit(random));
      const std::string name = "b" + std::to_string(k) + "_";
      positions += (k > 0 ? ", " : "") + name + "x: " + std::to_string(0.2 * unit(random)) + ", " +
                   name + "y: " + std::to_string(-1 + 0.5 * unit(random)) + ", " + name +
                   "angle: " + std::to_string(2 * unit(random) - 1);
      velocities += (k > 0 ? ", " : "") + name + "y: " + std::to_string(2 * unit(random) - 1) +
                    ", " + name + "angle: " + std::to_string(2 * unit(random) - 1);
    }
    const RobotSystem bodies =
        Make("<robot name='r'><link name='w'/>" + links + "</robot>",
             "{base: fixed, constraints: {ground: {kind: plane, link: b0, point: [0, 0, 0], "
             "radius: 0.1}}, nominal: {positions: {" +
                 positions + "}, velocities: {" + velocities + "}, duration: 0.06}}");
    const NominalRun& nominal = bodies.nominal();
    const Trajectory run = Simulate(bodies, nominal.x, nominal.u, nominal.duration);
    EXPECT_LT(JacobiansOf(bodies, run), 100) << trial;
  }
}

}  // namespace
}  // namespace contact_flow
