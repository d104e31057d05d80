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
    const Vec3<S> com =
        body.position - state->reference + body.rotation * inertia.com.cast<S>();
    body.inertia = PlaceInertia<S>(S(inertia.mass), inertia.central.cast<S>(), body.rotation, com);
  }
}

/// Recursive Newton–Euler algorithm (Featherstone 2008, Table 5.1, in world coordinates):
///   τ = M(q) v̇ + b(q, v) − Jᵀ (external forces)       [nv]
/// with b the Coriolis, centrifugal and gravitational terms, after UpdateVelocities and UpdateInertias.
/// `vdot` null is v̇ = 0. `external` (null: none) holds a spatial force on each body.
template <class S>
void InverseDynamics(const RigidBodyTree& tree, const Vec3<S>& gravity, const S* vdot,
                     const Spatial<S>* external, TreeState<S>* state, S* tau) {
  const std::vector<RigidBodyTree::Body>& bodies = tree.bodies();
  const int count = tree.num_bodies();
  for (int i = 0; i < count; ++i) {
    typename TreeState<S>::Body& body = state->body[i];
    const int parent = bodies[i].parent;
    Spatial<S> a;
    if (parent < 0) {
      a = {Zero3<S>(), -gravity};
    } else {
      // Σ_j J̇_j v_j = v_parent × v: a joint's axes are carried by the parent or by the body.
      const typename TreeState<S>::Body& before = state->body[parent];
      a = before.acceleration + CrossMotion(before.velocity, body.velocity);
    }
    if (vdot != nullptr) {
      for (int j = bodies[i].v; j < bodies[i].v + bodies[i].num_dofs; ++j) {
        a += vdot[j] * state->dof[j].axis;
      }
    }
    body.acceleration = a;
    if (bodies[i].inertia.mass == 0) {
      body.force = Spatial<S>::Zero();
    } else {
      body.force = body.inertia * a + CrossForce(body.velocity, body.inertia * body.velocity);
    }
    if (external != nullptr) body.force -= external[i];
  }
  for (int i = count - 1; i >= 0; --i) {
    const Spatial<S>& force = state->body[i].force;
    for (int j = bodies[i].v; j < bodies[i].v + bodies[i].num_dofs; ++j) {
      tau[j] = Dot(state->dof[j].axis, force);
    }
    if (bodies[i].parent >= 0) state->body[bodies[i].parent].force += force;
  }
}

}  // namespace contact_flow
