// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <random>

#include "contact_flow/model/rigid_body/kinematics.h"

namespace contact_flow {

/// Trees, states and vectors at random.
class RandomTrees {
 public:
  explicit RandomTrees(unsigned seed) : generator_(seed) {}

  double Normal() { return normal_(generator_); }
  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator_);
  }
  int Whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(generator_); }
  Vector NormalVector(int size) {
    Vector v(size);
    for (int i = 0; i < size; ++i) v(i) = Normal();
    return v;
  }
  Pose RandomPose() {
    const Vector q = NormalVector(4);
    return {QuaternionRotation(q.data()), 0.3 * NormalVector(3)};
  }
  /// Of a cloud of point masses: physical whatever the numbers.
  BodyInertia RandomInertia() {
    BodyInertia sum;
    for (int k = 0; k < 5; ++k) {
      BodyInertia point;
      point.mass = Uniform(0.1, 1);
      point.com = 0.2 * NormalVector(3);
      sum = sum + point;
    }
    return sum;
  }
  /// A free or fixed base and bodies of every kind of joint on it, without ball joints on request;
  /// those that slide freely are without mass and carry a ball joint.
  RigidBodyTree Tree(int bodies, bool free_base, bool balls = true) {
    RigidBodyTree tree;
    tree.set_gravity(Vec3<double>(0.3, -0.2, -9.81));
    int parent = -1;
    if (free_base) {
      tree.AddBody(-1, JointKind::kTranslation, Pose());
      parent = tree.AddBody(0, JointKind::kBall, Pose(), RandomInertia());
    }
    while (tree.num_bodies() < bodies) {
      if (tree.num_bodies() > 0) parent = Whole(free_base ? 1 : 0, tree.num_bodies() - 1);
      switch (Whole(balls ? 0 : 2, 4)) {
        case 2:
          tree.AddBody(parent, JointKind::kPrismatic, RandomPose(), RandomInertia());
          break;
        case 1:
          tree.AddBody(parent, JointKind::kBall, RandomPose(), RandomInertia());
          break;
        case 0:
          parent = tree.AddBody(parent, JointKind::kTranslation, RandomPose());
          tree.AddBody(parent, JointKind::kBall, Pose(), RandomInertia());
          break;
        default:
          tree.AddBody(parent, JointKind::kRevolute, RandomPose(), RandomInertia());
      }
    }
    return tree;
  }
  /// Unit quaternions, everything else of order 1.
  Vector Positions(const RigidBodyTree& tree) {
    Vector q = NormalVector(tree.num_positions());
    for (const RigidBodyTree::Body& body : tree.bodies()) {
      if (body.joint == JointKind::kBall) q.segment(body.q, 4).normalize();
    }
    return q;
  }

 private:
  std::mt19937 generator_;
  std::normal_distribution<double> normal_;
};

/// q̇ = N(q) v: the tangent η = v as a change of q.
template <class S>
Eigen::Matrix<S, Eigen::Dynamic, 1> PositionRate(const RigidBodyTree& tree,
                                                 const Eigen::Matrix<S, Eigen::Dynamic, 1>& q,
                                                 const Eigen::Matrix<S, Eigen::Dynamic, 1>& v) {
  Eigen::Matrix<S, Eigen::Dynamic, 1> rate(q.size());
  for (const RigidBodyTree::Body& body : tree.bodies()) {
    if (body.joint != JointKind::kBall) {
      rate.segment(body.q, body.num_dofs) = v.segment(body.v, body.num_dofs);
      continue;
    }
    const S *a = &q(body.q), *w = &v(body.v);
    rate(body.q) = -0.5 * (a[1] * w[0] + a[2] * w[1] + a[3] * w[2]);
    rate(body.q + 1) = 0.5 * (a[0] * w[0] + a[2] * w[2] - a[3] * w[1]);
    rate(body.q + 2) = 0.5 * (a[0] * w[1] + a[3] * w[0] - a[1] * w[2]);
    rate(body.q + 3) = 0.5 * (a[0] * w[2] + a[1] * w[1] - a[2] * w[0]);
  }
  return rate;
}

}  // namespace contact_flow
