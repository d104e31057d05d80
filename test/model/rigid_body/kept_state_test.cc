// SPDX-License-Identifier: BSD-3-Clause
// A robot keeps where it was evaluated last: nothing that it answers depends on that.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/rigid_body/robot_system.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

/// All that one kind of call fills in, in one vector.
Vector Call(const RobotSystem& system, int kind, const Vector& q, const Vector& v) {
  const Vector u = system.nominal().u, force = Vector::Constant(system.num_rows(), 0.7);
  const Vector other = Vector::LinSpaced(system.dof(), -1, 2);
  std::vector<double> all;
  const auto add = [&](const MatrixRef& numbers) {
    for (double number : numbers.reshaped()) all.push_back(number);
  };
  Matrix mass;
  Vector applied;
  ConstraintTerms terms;
  ResidualJacobian jacobian;
  switch (kind) {
    case 0:
      system.Dynamics(q, v, u, ContactMode(), &mass, &applied);
      add(mass);
      add(applied);
      break;
    case 1:
      system.Constraints(q, v, &terms);
      add(terms.gap);
      add(terms.bias);
      add(terms.jacobian);
      break;
    case 2:
      system.DifferentiateDynamics(q, v, u, ContactMode(), other, force, &jacobian);
      add(jacobian.momentum_q);
      add(jacobian.momentum_v);
      add(jacobian.constraint_q);
      add(jacobian.constraint_v);
      break;
    case 3:
      system.DifferentiateImpact(q, other, force, v, &jacobian);
      add(jacobian.momentum_q);
      add(jacobian.constraint_q);
      break;
    case 4:
      add(system.JointEfforts(q, v, u, ContactMode()));
  }
  return Eigen::Map<const Vector>(all.data(), static_cast<Eigen::Index>(all.size()));
}

/// Calls of all kinds at a few places, the same one after another and in any order, have the bits
/// of a robot that was never anywhere else.
TEST(KeptState, IsNotSeen) {
  constexpr int kKinds = 5, kPlaces = 2;
  for (const char* robot : {"everything_with_friction", "quadruped_friction", "gripper"}) {
    const auto kept = LoadRobot(RobotFile(robot));
    const int nq = kept->num_positions(), d = kept->dof();
    Vector q[kPlaces], v[kPlaces];
    for (int k = 0; k < kPlaces; ++k) {
      const Vector x =
          kept->Perturb(kept->nominal().x, Vector::LinSpaced(2 * d, 0.01 * k, 0.1 + 0.03 * k));
      q[k] = x.head(nq);
      v[k] = x.tail(d);
    }
    std::vector<Vector> fresh;
    for (int kind = 0; kind < kKinds; ++kind) {
      for (int place = 0; place < kPlaces * kPlaces; ++place) {
        const auto system = LoadRobot(RobotFile(robot));
        fresh.push_back(Call(*system, kind, q[place / kPlaces], v[place % kPlaces]));
      }
    }
    std::mt19937 random(3);
    for (int call = 0; call < 300; ++call) {
      const auto which = static_cast<int>(random() % fresh.size());
      const int kind = which / (kPlaces * kPlaces), place = which % (kPlaces * kPlaces);
      const Vector again = Call(*kept, kind, q[place / kPlaces], v[place % kPlaces]);
      ASSERT_EQ(fresh[which].size(), again.size());
      ASSERT_TRUE((fresh[which].array() == again.array()).all())
          << robot << ", call " << call << " of kind " << kind;
    }
  }
}

}  // namespace
}  // namespace contact_flow
