// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/inverse_dynamics.h"

namespace contact_flow {

/// Inertia of all that each body carries, after UpdateInertias.
template <class S>
void CompositeInertias(const RigidBodyTree& tree, TreeState<S>* state) {
  for (typename TreeState<S>::Body& body : state->body) body.composite = body.inertia;
  for (int i = tree.num_bodies() - 1; i >= 0; --i) {
    const int parent = tree.bodies()[i].parent;
    if (parent >= 0) state->body[parent].composite += state->body[i].composite;
  }
}

/// Momentum that a unit rate of each joint gives to all that it carries, after UpdateInertias;
/// fills CompositeInertias too.
template <class S>
void UpdateMomenta(const RigidBodyTree& tree, TreeState<S>* state) {
  CompositeInertias(tree, state);
  for (int j = 0; j < tree.dof(); ++j) {
    typename TreeState<S>::Dof& dof = state->dof[j];
    dof.momentum = state->body[tree.dof_body(j)].composite * dof.axis;
  }
}

/// Composite-rigid-body algorithm (Featherstone 2008, Table 6.2, in world coordinates): M(q), both
/// triangles, into `mass` [nv×nv], column-major. Fills UpdateMomenta.
template <class S>
void MassMatrix(const RigidBodyTree& tree, TreeState<S>* state, S* mass) {
  UpdateMomenta(tree, state);
  const int n = tree.dof();
  for (int k = 0; k < n * n; ++k) mass[k] = S(0.0);
  for (int j = 0; j < n; ++j) {
    const Spatial<S>& momentum = state->dof[j].momentum;
    for (int i = j; i >= 0; i = tree.dof_parent(i)) {
      mass[i + j * n] = mass[j + i * n] = Dot(state->dof[i].axis, momentum);
    }
  }
}

}  // namespace contact_flow
