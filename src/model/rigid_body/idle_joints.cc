// SPDX-License-Identifier: BSD-3-Clause
#include "idle_joints.h"

namespace contact_flow {
namespace {

/// Square of a distance from an axis that is rounding [m²].
constexpr double kNoArm = 1e-20;

}  // namespace

std::vector<std::string> IdleJoints(const RobotModel& robot) {
  const RigidBodyTree& tree = robot.tree;
  const int bodies = tree.num_bodies();
  std::vector<double> mass(bodies), inertia(bodies);  // of a body and all that it carries
  for (int i = bodies - 1; i >= 0; --i) {             // children come after their parents
    const RigidBodyTree::Body& body = tree.bodies()[i];
    mass[i] += body.inertia.mass;
    inertia[i] += body.inertia.central.norm();
    if (body.parent < 0) continue;
    mass[body.parent] += mass[i];
    inertia[body.parent] += inertia[i];
  }
  std::vector<std::string> idle;
  for (int i = 0; i < bodies; ++i) {
    const RigidBodyTree::Body& body = tree.bodies()[i];
    bool moves = mass[i] > 0 || inertia[i] > 0;
    if (body.joint == JointKind::kPrismatic) moves = mass[i] > 0;
    if (body.joint == JointKind::kRevolute) {
      moves = inertia[i] > 0;
      bool alone = true;  // of what it carries only its own body has mass
      for (int k = i + 1; k < bodies; ++k) alone &= tree.bodies()[k].parent != i || mass[k] == 0;
      const Vec3<double>& c = body.inertia.com;
      moves |= body.inertia.mass > 0 && c(0) * c(0) + c(1) * c(1) > kNoArm;
      moves |= mass[i] > 0 && !alone;
    }
    if (moves) continue;
    for (const RobotModel::JointTraits& traits : robot.traits) {
      if (traits.name == robot.coordinates[body.q]) idle.push_back(traits.name);
    }
  }
  return idle;
}

}  // namespace contact_flow
