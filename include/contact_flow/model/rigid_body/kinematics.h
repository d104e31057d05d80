// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/model/rigid_body/tree_state.h"

namespace contact_flow {

/// Rotation matrix of a quaternion (w, x, y, z) of any length: depends on its direction alone.
template <class S>
inline Mat3<S> QuaternionRotation(const S* q) {
  const S w = q[0], x = q[1], y = q[2], z = q[3];
  const S s = 2.0 / (w * w + x * x + y * y + z * z);
  const S sx = s * x, sy = s * y, sz = s * z;
  Mat3<S> R;
  R(0, 0) = 1.0 - (sy * y + sz * z);
  R(1, 1) = 1.0 - (sx * x + sz * z);
  R(2, 2) = 1.0 - (sx * x + sy * y);
  R(0, 1) = sx * y - sz * w;
  R(1, 0) = sx * y + sz * w;
  R(0, 2) = sx * z + sy * w;
  R(2, 0) = sx * z - sy * w;
  R(1, 2) = sy * z - sx * w;
  R(2, 1) = sy * z + sx * w;
  return R;
}

/// Poses of all bodies and the columns of their joints at q [nq].
template <class S>
void UpdatePositions(const RigidBodyTree& tree, const S* q, TreeState<S>* state) {
  using std::cos;
  using std::sin;
  const std::vector<RigidBodyTree::Body>& bodies = tree.bodies();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const RigidBodyTree::Body& fixed = bodies[i];
    typename TreeState<S>::Body& body = state->body[i];
    Mat3<S> R;
    if (fixed.parent < 0) {
      R = fixed.placement.rotation.cast<S>();
      body.position = fixed.placement.position.cast<S>();
    } else {
      const typename TreeState<S>::Body& parent = state->body[fixed.parent];
      R.noalias() = parent.rotation * fixed.placement.rotation.cast<S>();
      body.position = parent.position + parent.rotation * fixed.placement.position.cast<S>();
    }
    const S* p = q + fixed.q;
    switch (fixed.joint) {
      case JointKind::kRevolute: {
        const S c = cos(p[0]), s = sin(p[0]);
        body.rotation.col(0) = c * R.col(0) + s * R.col(1);
        body.rotation.col(1) = c * R.col(1) - s * R.col(0);
        body.rotation.col(2) = R.col(2);
        break;
      }
      case JointKind::kPrismatic:
        body.rotation = R;
        body.position += p[0] * R.col(2);
        break;
      case JointKind::kTranslation:
        body.rotation = R;
        body.position += p[0] * R.col(0) + p[1] * R.col(1) + p[2] * R.col(2);
        break;
      case JointKind::kBall:
        body.rotation.noalias() = R * QuaternionRotation(p);
        break;
    }
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    typename TreeState<S>::Body& body = state->body[i];
    body.reference = state->body[bodies[i].reference].position;
    typename TreeState<S>::Dof* dof = &state->dof[bodies[i].v];
    const Vec3<S> arm = body.position - body.reference;
    const auto turn = [&](int column) {
      const Vec3<S> axis = body.rotation.col(column);
      return Spatial<S>{axis, Cross(arm, axis)};
    };
    switch (bodies[i].joint) {
      case JointKind::kRevolute:
        dof[0].axis = turn(2);
        break;
      case JointKind::kPrismatic:
        dof[0].axis = {Zero3<S>(), body.rotation.col(2)};
        break;
      case JointKind::kTranslation:
        for (int k = 0; k < 3; ++k) dof[k].axis = {Zero3<S>(), body.rotation.col(k)};
        break;
      case JointKind::kBall:
        for (int k = 0; k < 3; ++k) dof[k].axis = turn(k);
        break;
    }
  }
}

/// Velocities of all bodies at v [nv], after UpdatePositions.
template <class S>
void UpdateVelocities(const RigidBodyTree& tree, const S* v, TreeState<S>* state) {
  const std::vector<RigidBodyTree::Body>& bodies = tree.bodies();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const int parent = bodies[i].parent;
    Spatial<S> velocity = parent < 0 ? Spatial<S>::Zero() : state->body[parent].velocity;
    for (int j = bodies[i].v; j < bodies[i].v + bodies[i].num_dofs; ++j) {
      velocity += v[j] * state->dof[j].axis;
    }
    state->body[i].velocity = velocity;
  }
}

/// A point fixed in a body (or in the world): where it is and how it moves, in world axes.
template <class S>
struct PointMotion {
  Vec3<S> position;      ///< [m]
  Vec3<S> velocity;      ///< [m/s]
  Vec3<S> acceleration;  ///< [m/s²]
};

/// Position in the world of `point`, given in the body's frame.
template <class S>
inline Vec3<S> PointPosition(const TreeState<S>& state, int body, const Vec3<S>& point) {
  if (body < 0) return point;
  return state.body[body].position + state.body[body].rotation * point;
}
/// Velocity of the body's point now at `position`.
template <class S>
inline Vec3<S> PointVelocity(const TreeState<S>& state, int body, const Vec3<S>& position) {
  if (body < 0) return Zero3<S>();
  const Spatial<S>& v = state.body[body].velocity;
  return v.lin + Cross(v.ang, Vec3<S>(position - state.body[body].reference));
}
/// ∂(velocity of the body's point now at `position`)/∂v_j, for a j that moves the body.
template <class S>
inline Vec3<S> PointColumn(const TreeState<S>& state, int body, int j, const Vec3<S>& position) {
  const Spatial<S>& axis = state.dof[j].axis;
  return axis.lin + Cross(axis.ang, Vec3<S>(position - state.body[body].reference));
}
/// Acceleration of the body's point now at `position`, from the body's `acceleration` as a spatial
/// vector (without the gravity that TreeState takes off).
template <class S>
inline Vec3<S> PointAcceleration(const TreeState<S>& state, int body,
                                 const Spatial<S>& acceleration, const Vec3<S>& position) {
  if (body < 0) return Zero3<S>();
  const Vec3<S> arm = position - state.body[body].reference;
  const Spatial<S>& v = state.body[body].velocity;
  return acceleration.lin + Cross(acceleration.ang, arm) +
         Cross(v.ang, Vec3<S>(v.lin + Cross(v.ang, arm)));
}

}  // namespace contact_flow
