// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/model/rigid_body/mass_matrix.h"

namespace contact_flow {

/// Derivatives of inverse dynamics,
///   τ(q, v) = M(q) v̇ + b(q, v) − Σ_points J(q)ᵀ F,
/// at fixed v̇ and fixed forces F in world axes, by tangents η and by v.
///
/// A motion along η_j turns all that j carries by the spatial axis J_j as one rigid body, but for
/// the velocity and acceleration that the joint's own parent p lends it. With ψ_j = v_p × J_j, for
/// each body i that j carries (compare Carpentier & Mansard 2018; Singh, Russo & Wensing 2022):
///   ∂f_i/∂η_j = J_j ×* f_i + I_i (a_p × J_j + v_p × ψ_j) + B_i ψ_j + C_i J_j,
///   ∂f_i/∂v_j = I_i (J̇_j + ψ_j) + B_i J_j,
///   B_i ψ = ψ ×* I_i v_i + v_i ×* I_i ψ − I_i (v_i × ψ),
/// C from the point forces. The first term turns with the axis that it is projected on and falls
/// out of the rows that j carries. B and C see only the angular part: B = (B̄; −2 [p]×), p the
/// linear momentum. Everything adds up along the tree, so each pair of numbers on one way to the
/// root costs four short products.
template <class S>
class InverseDynamicsJacobian {
 public:
  explicit InverseDynamicsJacobian(const RigidBodyTree& tree)
      : body_(tree.num_bodies()), dof_(tree.dof()) {}

  /// ∂τ/∂η and ∂τ/∂v [nv×nv], column-major and overwritten; `tau_v` may be null. After
  /// InverseDynamics with these forces (null: none) and UpdateMomenta at the same state.
  void Compute(const RigidBodyTree& tree, const Vec3<S>& gravity, const PointForces<S>* external,
               const TreeState<S>& state, S* tau_q, S* tau_v);

 private:
  using Row = Eigen::Matrix<S, 12, 1>;
  using Short = Eigen::Matrix<S, 6, 1>;
  struct Body {
    Mat3<S> coriolis;  // B̄ of all that it carries
    Vec3<S> momentum;  // p of all that it carries
    Mat3<S> turning;   // C̄ of all that it carries
    Vec3<S> push;      // sum of the point forces
  };
  struct Dof {
    Row row;        // Jᵀ (I, B, C) of what it carries
    Row column_q;   // (a_p × J + v_p × ψ, ψ angular, J angular)
    Row column_v;   // (J̇ + ψ, J angular, 0)
    Short axis;     // J
    Short force_q;  // ∂/∂η of the net force on what it carries
    Short force_v;  // ∂/∂v of the same
  };

  void AddBodies(const RigidBodyTree& tree, const PointForces<S>* external,
                 const TreeState<S>& state);
  void FillDof(const RigidBodyTree& tree, const Vec3<S>& gravity, const TreeState<S>& state, int j);

  std::vector<Body> body_;
  std::vector<Dof> dof_;
};

template <class S>
void InverseDynamicsJacobian<S>::AddBodies(const RigidBodyTree& tree,
                                           const PointForces<S>* external,
                                           const TreeState<S>& state) {
  for (int i = 0; i < tree.num_bodies(); ++i) {
    Body& body = body_[i];
    if (external != nullptr) {
      body.turning = external[i].turning;
      body.push = external[i].force.lin;
    } else {
      body.turning = ZeroMat3<S>();
      body.push = Zero3<S>();
    }
    const SpatialInertia<S>& I = state.body[i].inertia;
    const Spatial<S>& v = state.body[i].velocity;
    const Spatial<S> P = I * v;
    body.momentum = P.lin;
    const Vec3<S>&w = v.ang, &u = v.lin, &c = I.moment, &L = P.ang;
    // ω × Ī − Ī ω×, a symmetric matrix: X + Xᵀ with X = [ω]× Ī.
    Mat3<S> X;
    X.col(0) = Cross(w, Vec3<S>(I.xx, I.xy, I.xz));
    X.col(1) = Cross(w, Vec3<S>(I.xy, I.yy, I.yz));
    X.col(2) = Cross(w, Vec3<S>(I.xz, I.yz, I.zz));
    const S uc = 2.0 * Dot(u, c);
    Mat3<S>& B = body.coriolis;
    for (int r = 0; r < 3; ++r) {
      for (int k = 0; k < 3; ++k) B(r, k) = X(r, k) + X(k, r) - c(r) * u(k) - u(r) * c(k);
      B(r, r) += uc;
    }
    B(0, 1) += L(2);
    B(1, 0) -= L(2);
    B(0, 2) -= L(1);
    B(2, 0) += L(1);
    B(1, 2) += L(0);
    B(2, 1) -= L(0);
  }
  for (int i = tree.num_bodies() - 1; i >= 0; --i) {
    const int parent = tree.bodies()[i].parent;
    if (parent < 0) continue;
    body_[parent].coriolis += body_[i].coriolis;
    body_[parent].momentum += body_[i].momentum;
    body_[parent].turning += body_[i].turning;
    body_[parent].push += body_[i].push;
  }
}

template <class S>
void InverseDynamicsJacobian<S>::FillDof(const RigidBodyTree& tree, const Vec3<S>& gravity,
                                         const TreeState<S>& state, int j) {
  const int b = tree.dof_body(j), parent = tree.bodies()[b].parent;
  const Spatial<S>& J = state.dof[j].axis;
  const typename TreeState<S>::Body& body = state.body[b];
  const Body& sum = body_[b];
  const Spatial<S> rate = CrossMotion(body.velocity, J);  // J̇
  Spatial<S> psi, lent;
  if (parent < 0) {
    psi = Spatial<S>::Zero();
    lent = {Zero3<S>(), Cross(Vec3<S>(-gravity), J.ang)};
  } else {
    const typename TreeState<S>::Body& before = state.body[parent];
    psi = CrossMotion(before.velocity, J);
    lent = CrossMotion(before.acceleration, J) + CrossMotion(before.velocity, psi);
  }
  const Spatial<S> both = rate + psi;
  const Vec3<S> Bt = sum.coriolis.transpose() * J.ang + 2.0 * Cross(sum.momentum, J.lin);
  const Vec3<S> Ct = sum.turning.transpose() * J.ang + Cross(sum.push, J.lin);
  Dof& dof = dof_[j];
  dof.row << state.dof[j].momentum.ang, state.dof[j].momentum.lin, Bt, Ct;
  dof.column_q << lent.ang, lent.lin, psi.ang, J.ang;
  dof.column_v << both.ang, both.lin, J.ang, Zero3<S>();
  dof.axis << J.ang, J.lin;
  const Spatial<S> turned = CrossForce(J, body.force), pulled = body.composite * lent,
                   lagging = body.composite * both;
  dof.force_q << turned.ang + pulled.ang + sum.coriolis * psi.ang + sum.turning * J.ang,
      turned.lin + pulled.lin + 2.0 * Cross(psi.ang, sum.momentum) + Cross(J.ang, sum.push);
  dof.force_v << lagging.ang + sum.coriolis * J.ang, lagging.lin + 2.0 * Cross(J.ang, sum.momentum);
}

template <class S>
void InverseDynamicsJacobian<S>::Compute(const RigidBodyTree& tree, const Vec3<S>& gravity,
                                         const PointForces<S>* external, const TreeState<S>& state,
                                         S* tau_q, S* tau_v) {
  AddBodies(tree, external, state);
  const int n = tree.dof();
  for (int k = 0; k < n * n; ++k) tau_q[k] = S(0.0);
  if (tau_v != nullptr) {
    for (int k = 0; k < n * n; ++k) tau_v[k] = S(0.0);
  }
  for (int k = 0; k < n; ++k) {
    FillDof(tree, gravity, state, k);
    const Dof& far = dof_[k];
    for (int j = k; j >= 0; j = tree.dof_parent(j)) {
      const Dof& near = dof_[j];
      // Row k, which j carries; then row j, unless j and k are of one joint, where each
      // carries both.
      const bool joint = tree.dof_body(j) == tree.dof_body(k);
      tau_q[k + j * n] = far.row.cwiseProduct(near.column_q).sum();
      if (j != k) {
        tau_q[j + k * n] = joint ? near.row.cwiseProduct(far.column_q).sum()
                                 : near.axis.cwiseProduct(far.force_q).sum();
      }
      if (tau_v == nullptr) continue;
      tau_v[k + j * n] = far.row.cwiseProduct(near.column_v).sum();
      if (j != k) {
        tau_v[j + k * n] = joint ? near.row.cwiseProduct(far.column_v).sum()
                                 : near.axis.cwiseProduct(far.force_v).sum();
      }
    }
  }
}

}  // namespace contact_flow
