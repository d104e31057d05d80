// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/kinematics.h"

namespace contact_flow {

/// Inertias of all bodies in world axes, after UpdatePositions.
template <class S>
void UpdateInertias(const RigidBodyTree& tree, TreeState<S>* state) {
  const std::vector<RigidBodyTree::Body>& bodies = tree.bodies();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    typename TreeState<S>::Body& body = state->body[i];
    const BodyInertia& inertia = bodies[i].inertia;
    if (inertia.mass == 0) {
      body.inertia = SpatialInertia<S>::Zero();
      continue;
    }
    const Vec3<S> com = body.position - body.reference + body.rotation * inertia.com.cast<S>();
    body.inertia = PlaceInertia<S>(S(inertia.mass), inertia.central.cast<S>(), body.rotation, com);
  }
}

/// The sum of forces on points of one body, and of torques on it, each fixed in world axes while
/// the body moves.
template <class S>
struct PointForces {
  Spatial<S> force;  ///< their spatial force about the body's reference point
  /// w ↦ Σ r × (w × F) + Σ w × τ: by how much their moment changes less than a force fixed in the
  /// body would, when the body turns by w.
  Mat3<S> turning;

  void SetZero() {
    force = Spatial<S>::Zero();
    turning = ZeroMat3<S>();
  }
  /// A force F [N] at r from the reference point [m].
  void Add(const Vec3<S>& r, const Vec3<S>& F) {
    force.ang += Cross(r, F);
    force.lin += F;
    const S along = Dot(r, F);
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) turning(i, k) -= F(i) * r(k);
      turning(i, i) += along;
    }
  }
  /// A torque τ [N·m].
  void AddTorque(const Vec3<S>& torque) {
    force.ang += torque;
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3, last = (k + 2) % 3;
      turning(k, next) += torque(last);
      turning(next, k) -= torque(last);
    }
  }
};

/// Accelerations of all bodies, less gravity, at v̇ [nv] (null: zero), after UpdateVelocities.
template <class S>
void UpdateAccelerations(const RigidBodyTree& tree, const Vec3<S>& gravity, const S* vdot,
                         TreeState<S>* state) {
  const std::vector<RigidBodyTree::Body>& bodies = tree.bodies();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    typename TreeState<S>::Body& body = state->body[i];
    if (bodies[i].parent < 0) {
      body.acceleration = {Zero3<S>(), -gravity};
    } else {
      // Σ_j J̇_j v_j = v_parent × v: a joint's axes are carried by the parent or by the body.
      const typename TreeState<S>::Body& before = state->body[bodies[i].parent];
      body.acceleration = before.acceleration + CrossMotion(before.velocity, body.velocity);
    }
    if (vdot == nullptr) continue;
    for (int j = bodies[i].v; j < bodies[i].v + bodies[i].num_dofs; ++j) {
      body.acceleration += vdot[j] * state->dof[j].axis;
    }
  }
}

/// Recursive Newton–Euler algorithm (Featherstone 2008, Table 5.1, in world coordinates):
///   τ = M(q) v̇ + b(q, v) − Σ Jᵀ (external forces)       [nv]
/// with b the Coriolis, centrifugal and gravitational terms, after UpdateVelocities and
/// UpdateInertias. `vdot` null is v̇ = 0. `external` (null: none) holds the forces on each body.
template <class S>
void InverseDynamics(const RigidBodyTree& tree, const Vec3<S>& gravity, const S* vdot,
                     const PointForces<S>* external, TreeState<S>* state, S* tau) {
  UpdateAccelerations(tree, gravity, vdot, state);
  const std::vector<RigidBodyTree::Body>& bodies = tree.bodies();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    typename TreeState<S>::Body& body = state->body[i];
    if (bodies[i].inertia.mass == 0) {
      body.force = Spatial<S>::Zero();
    } else {
      body.force = body.inertia * body.acceleration +
                   CrossForce(body.velocity, body.inertia * body.velocity);
    }
    if (external != nullptr) body.force -= external[i].force;
  }
  for (int i = tree.num_bodies() - 1; i >= 0; --i) {
    const Spatial<S>& force = state->body[i].force;
    for (int j = bodies[i].v; j < bodies[i].v + bodies[i].num_dofs; ++j) {
      tau[j] = Dot(state->dof[j].axis, force);
    }
    if (bodies[i].parent >= 0) state->body[bodies[i].parent].force += force;
  }
}

}  // namespace contact_flow
