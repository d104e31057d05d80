// SPDX-License-Identifier: BSD-3-Clause
// Boxes that fall onto ground whose normals differ from corner to corner, and come to rest there.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>
#include <sstream>
#include <string>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

constexpr double kFriction = 0.5, kWeight = 9.81;

struct FallingBox {
  Vec3<double> centre;  // of mass
  std::string urdf;
};

FallingBox RandomBox(std::mt19937* random) {
  std::uniform_real_distribution<double> size(0.05, 0.3), inertia(0.005, 0.02), place(-0.02, 0.02);
  FallingBox box;
  for (double& entry : box.centre) entry = place(*random);
  std::ostringstream urdf;
  urdf.precision(17);
  urdf << "<robot name=\"r\"><link name=\"box\"><inertial><origin xyz=\"" << box.centre.transpose()
       << "\"/><mass value=\"1\"/><inertia ixy=\"0\" ixz=\"0\" iyz=\"0\"";
  for (const char* axis : {"ixx", "iyy", "izz"}) {
    urdf << ' ' << axis << "=\"" << inertia(*random) << '"';
  }
  urdf << "/></inertial><collision><geometry><box size=\"" << size(*random) << ' ' << size(*random)
       << ' ' << size(*random) << "\"/></geometry></collision></link></robot>";
  box.urdf = urdf.str();
  return box;
}

/// Turned at random, 0.03 m above the ground, with some velocity.
Vector Thrown(const MechanicalSystem& system, std::mt19937* random) {
  std::normal_distribution<double> normal;
  Vector w(2 * system.dof());
  for (double& entry : w) entry = normal(*random);
  w.tail(system.dof()) *= 0.5;
  Vector x = system.Perturb(system.nominal().x, w);
  ConstraintTerms terms;
  for (int k = 0; k < 50; ++k) {
    system.Constraints(x.head(system.num_positions()), x.tail(system.dof()), &terms);
    x(2) += 0.03 - terms.gap.minCoeff();
  }
  return x;
}

std::string HeightMap(std::mt19937* random) {
  std::uniform_real_distribution<double> height(0, 0.05);
  std::ostringstream map;
  map << "{kind: height_map, step: [0.25, 0.25], origin: [-3, -3], heights: [";
  for (int j = 0; j < 25; ++j) {
    map << (j > 0 ? ", [" : "[");
    for (int i = 0; i < 25; ++i) map << (i > 0 ? ", " : "") << height(*random);
    map << ']';
  }
  map << "]}";
  return map.str();
}

/// What rises is made rest, and ends slips with it: of these no direction is left. What runs end
/// with are forces in their cones that bear the weight.
TEST(CurvedGround, BoxesComeToRestOnCorners) {
  int rests = 0;
  for (const bool map : {false, true}) {
    for (const int seed : {1, 5, 8, 12, 17, 18}) {
      SCOPED_TRACE((map ? "height_map " : "height_field ") + std::to_string(seed));
      std::mt19937 random(static_cast<unsigned>(seed));
      const FallingBox box = RandomBox(&random);
      const std::string ground =
          map ? HeightMap(&random) : "{kind: height_field, amplitude: 0.03, wave_x: 5, wave_y: 2}";
      const RobotSystem system(
          ParseRobot(box.urdf, YAML::Load("{base: floating, contacts: {ground: all, friction: "
                                          "0.5}, terrain: {floor: " +
                                          ground + "}}")),
          {});
      SimulateOptions options;
      options.complete_zeno = true;
      const Vector u = system.nominal().u;
      const Trajectory run = Simulate(system, Thrown(system, &random), u, 1.5, options);
      EXPECT_TRUE(run.status.ok()) << run.status.message;
      const ContactMode mode = run.arcs.back().mode;
      const Vector x = run.FinalState();
      if (mode.Size() < 3 || x.tail(system.dof()).norm() > 1e-9) continue;
      ++rests;
      EXPECT_EQ(mode.Members(), mode.Sticking()) << mode.Word(8);
      ContactDynamics dynamics(system, u);
      dynamics.Evaluate(x, mode);
      ConstraintTerms terms;
      system.Constraints(x.head(system.num_positions()), x.tail(system.dof()), &terms);
      const Vector force = dynamics.force();
      const Vector pushed = terms.jacobian.transpose() * force;
      const Vec3<double> up = kWeight * Vec3<double>::UnitZ();
      EXPECT_LT((pushed.head<3>() - up).norm(), 1e-7);
      const Eigen::Quaterniond turned(x(3), x(4), x(5), x(6));
      const Vec3<double> moment = box.centre.cross(turned.inverse() * up);
      EXPECT_LT((pushed.segment<3>(3) - moment).norm(), 1e-7);
      for (int i : mode) {
        const double across = force.segment(system.friction()[i].row, 2).norm();
        EXPECT_GE(force(i), 0);
        EXPECT_LE(across, kFriction * force(i) * (1 + 1e-9));
      }
    }
  }
  EXPECT_GE(rests, 6);
}

}  // namespace
}  // namespace contact_flow
