// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/rigid_body/rigid_body_tree.h"

#include <stdexcept>
#include <string>

namespace contact_flow {
namespace {

/// −[c]×² : the rotational inertia of a unit mass at c.
Mat3<double> UnitMassAt(const Vec3<double>& c) {
  return c.squaredNorm() * Mat3<double>::Identity() - c * c.transpose();
}

}  // namespace

BodyInertia BodyInertia::In(const Pose& pose) const {
  return {mass, pose * com, pose.rotation * central * pose.rotation.transpose()};
}

BodyInertia BodyInertia::operator+(const BodyInertia& other) const {
  if (mass == 0) return other;
  if (other.mass == 0) return *this;
  BodyInertia sum;
  sum.mass = mass + other.mass;
  sum.com = (mass * com + other.mass * other.com) / sum.mass;
  sum.central = central + mass * UnitMassAt(com - sum.com) + other.central +
                other.mass * UnitMassAt(other.com - sum.com);
  return sum;
}

int RigidBodyTree::AddBody(int parent, JointKind joint, const Pose& placement,
                           const BodyInertia& inertia) {
  if (parent < -1 || parent >= num_bodies()) {
    throw std::invalid_argument("RigidBodyTree: there is no body " + std::to_string(parent));
  }
  const int index = num_bodies();
  const bool single = joint == JointKind::kRevolute || joint == JointKind::kPrismatic;
  const int dofs = single ? 1 : 3;
  const int first = dof();
  if (first + dofs > kMaxDof) {
    throw std::invalid_argument("RigidBodyTree: more than " + std::to_string(kMaxDof) +
                                " degrees of freedom");
  }
  for (int k = 0; k < dofs; ++k) {
    dof_body_.push_back(index);
    dof_parent_.push_back(k > 0 ? first + k - 1 : last_dof(parent));
  }
  bodies_.push_back(
      {parent, joint, placement, inertia, num_positions_, first, dofs, first + dofs - 1, index});
  num_positions_ += joint == JointKind::kBall ? 4 : dofs;
  ChooseReferences();
  return index;
}

void RigidBodyTree::AddInertia(int body, const BodyInertia& inertia) {
  if (body >= 0) SetInertia(body, bodies_.at(body).inertia + inertia);
}

void RigidBodyTree::SetInertia(int body, const BodyInertia& inertia) {
  bodies_.at(body).inertia = inertia;
  ChooseReferences();
}

void RigidBodyTree::ChooseReferences() {
  std::vector<int> branch(bodies_.size()), massive(bodies_.size(), -1);
  for (int i = 0; i < num_bodies(); ++i) {
    const int parent = bodies_[i].parent;
    branch[i] = parent < 0 ? i : branch[parent];
    if (massive[branch[i]] < 0 && bodies_[i].inertia.mass > 0) massive[branch[i]] = i;
  }
  for (int i = 0; i < num_bodies(); ++i) {
    bodies_[i].reference = massive[branch[i]] < 0 ? branch[i] : massive[branch[i]];
  }
}

Vector RigidBodyTree::Neutral() const {
  Vector q = Vector::Zero(num_positions_);
  for (const Body& body : bodies_) {
    if (body.joint == JointKind::kBall) q(body.q) = 1;
  }
  return q;
}

bool RigidBodyTree::HasConstantMass() const {
  std::vector<bool> turns(bodies_.size());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    const bool carried_by_turning = body.parent >= 0 && turns[body.parent];
    if (carried_by_turning || body.joint == JointKind::kBall) return false;
    if (body.joint == JointKind::kRevolute) {
      const bool centred = body.inertia.com(0) == 0 && body.inertia.com(1) == 0;
      if (body.inertia.mass > 0 && !centred) return false;
      turns[i] = true;
    }
  }
  return true;
}

}  // namespace contact_flow
