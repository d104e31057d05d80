// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/model/rigid_body/rigid_body_tree.h"

namespace contact_flow {

/// All that is computed about one state of a RigidBodyTree, the scratch of its algorithms: sized
/// once, never allocating after. Every spatial vector is in world axes about the `reference` of its
/// body, a point that is fixed in the world though chosen anew at each state, and the same for all
/// bodies of one branch from the world. Each field says which function fills it.
template <class S>
struct TreeState {
  struct Body {
    Mat3<S> rotation;             ///< body to world axes (UpdatePositions)
    Vec3<S> position;             ///< of the body's origin in the world [m] (UpdatePositions)
    Vec3<S> reference;            ///< point of its spatial vectors [m] (UpdatePositions)
    Spatial<S> velocity;          ///< (UpdateVelocities)
    Spatial<S> acceleration;      ///< less gravity (UpdateAccelerations)
    SpatialInertia<S> inertia;    ///< of the body alone (UpdateInertias)
    SpatialInertia<S> composite;  ///< of all that it carries (CompositeInertias)
    Spatial<S> force;             ///< net force on all that it carries (InverseDynamics)
  };
  struct Dof {
    Spatial<S>
        axis;  ///< ∂(velocity of the body)/∂v_j, a column of S in world axes (UpdatePositions)
    Spatial<S> momentum;  ///< composite · axis (UpdateMomenta)
  };

  explicit TreeState(const RigidBodyTree& tree) : body(tree.num_bodies()), dof(tree.dof()) {}

  std::vector<Body> body;
  std::vector<Dof> dof;
};

}  // namespace contact_flow
