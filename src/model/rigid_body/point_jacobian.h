// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_geometry.h"
#include "contact_flow/model/rigid_body/kinematics.h"

namespace contact_flow {

/// How the motion of a point fixed in a body changes with tangent η_j and velocity
/// v_j, in world axes.
template <class S>
struct PointColumns {
  Vec3<S> jacobian;        ///< ∂p/∂η_j = ∂ṗ/∂v_j
  Vec3<S> velocity_q;      ///< ∂ṗ/∂η_j
  Vec3<S> acceleration_q;  ///< ∂p̈/∂η_j, at fixed v̇
  Vec3<S> acceleration_v;  ///< ∂p̈/∂v_j, at fixed v̇
};

/// The columns of a j that moves `body`, after UpdateAccelerations. With ψ_j = v_p × J_j, p the
/// parent of j's joint:
///   ∂v/∂η_j = J_j × (v − v_p),    ∂a/∂η_j = J_j × (a − a_p) + ψ_j × (v − v_p),
///   ∂v/∂v_j = J_j,                ∂a/∂v_j = J̇_j + J_j × (v − v_p).
template <class S>
BodyColumns<S> DifferentiateBody(const RigidBodyTree& tree, const Vec3<S>& gravity,
                                 const TreeState<S>& state, int body, int j) {
  const int b = tree.dof_body(j), parent = tree.bodies()[b].parent;
  const Spatial<S>& J = state.dof[j].axis;
  const typename TreeState<S>::Body& moved = state.body[body];
  const Spatial<S> Jdot = CrossMotion(state.body[b].velocity, J);
  Spatial<S> v = moved.velocity, a = moved.acceleration, psi = Spatial<S>::Zero();
  if (parent < 0) {
    a.lin += gravity;
  } else {
    v -= state.body[parent].velocity;
    a -= state.body[parent].acceleration;
    psi = CrossMotion(state.body[parent].velocity, J);
  }
  const Spatial<S> v_q = CrossMotion(J, v);
  return {v_q, CrossMotion(J, a) + CrossMotion(psi, v), Jdot + v_q};
}

/// The columns of a j that moves `body`, for its point that moves as `motion`, from those of the
/// body's spatial velocity v and acceleration a (DifferentiateBody), of which
/// ṗ = v_lin + ω × r, p̈ = a_lin + α × r + ω × ṗ at r from the reference point.
template <class S>
PointColumns<S> DifferentiatePoint(const TreeState<S>& state, int body,
                                   const BodyColumns<S>& of_body, const PointMotion<S>& motion,
                                   int j) {
  const Spatial<S>& J = state.dof[j].axis;
  const typename TreeState<S>::Body& moved = state.body[body];
  const Spatial<S>&v_q = of_body.velocity_q, &a_q = of_body.acceleration_q,
        &a_v = of_body.acceleration_v;
  const Vec3<S> r = motion.position - moved.reference;
  const Vec3<S>& omega = moved.velocity.ang;
  PointColumns<S> columns;
  columns.jacobian = J.lin + Cross(J.ang, r);
  columns.velocity_q = v_q.lin + Cross(v_q.ang, r) + Cross(omega, columns.jacobian);
  columns.acceleration_q = a_q.lin + Cross(a_q.ang, r) +
                           Cross(moved.acceleration.ang, columns.jacobian) +
                           Cross(v_q.ang, motion.velocity) + Cross(omega, columns.velocity_q);
  columns.acceleration_v =
      a_v.lin + Cross(a_v.ang, r) + Cross(J.ang, motion.velocity) + Cross(omega, columns.jacobian);
  return columns;
}

/// Position, velocity and acceleration of the point of a body that is at `local` in the body's
/// frame, after UpdateAccelerations.
template <class S>
PointMotion<S> MovePoint(const TreeState<S>& state, const Vec3<S>& gravity, int body,
                         const Vec3<S>& local) {
  PointMotion<S> motion;
  motion.position = PointPosition(state, body, local);
  motion.velocity = PointVelocity(state, body, motion.position);
  if (body < 0) {
    motion.acceleration = Zero3<S>();
    return motion;
  }
  Spatial<S> a = state.body[body].acceleration;
  a.lin += gravity;
  motion.acceleration = PointAcceleration(state, body, a, motion.position);
  return motion;
}

}  // namespace contact_flow
