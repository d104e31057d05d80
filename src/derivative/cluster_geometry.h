// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/impact_reset.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/sparse_rows.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// What is the same after all impacts of a cluster, at its configuration ρ: M, its factor, Da, G.
///
/// The derivatives of an impact by q are linear in what it does,
///   ∂(M Δv − Daᵀ p)/∂q in (Δv, p),      ∂(Da v)/∂q in v,
/// so that those of a unit impulse of each contact, with the jump M⁻¹Da_iᵀ that it makes, tell all.
class ClusterGeometry {
 public:
  ClusterGeometry(const ContactDynamics& dynamics, const Transition& transition);

  const MechanicalSystem& system() const { return system_; }
  const std::shared_ptr<const InverseInertia>& inertia() const { return inertia_; }
  /// Da, Db [n+l × d].
  const std::shared_ptr<const SparseRows>& jacobian() const { return jacobian_; }
  double Rate(int i, const Vector& v) const { return jacobian_->Dot(i, v); }
  /// √G_ii [n].
  const Vector& mobility() const { return mobility_; }
  /// ∂(Da v)/∂q [n+l × d].
  SparseRows RatesBy(const Vector& v);
  /// The same of what an impact adds to v.
  SparseRows TurnedBy(const ImpactResult& impact, const Vector& v);

  /// Whether resets are products (ImpactReset::Terms).
  bool HasProducts() const { return products_; }
  /// Of an impact from v where ∂(Da v)/∂q = before_q; only where there are products.
  std::shared_ptr<const ImpactReset::Terms> Terms(const ImpactResult& impact,
                                                  const SparseRows& before_q, int tangents);
  /// DR of ImpactJacobian.
  ImpactReset Reset(const Vector& v, const ImpactResult& impact, ConstraintSet hit,
                    ConstraintSet persisting);
  /// v̇ [d] at (ρ, v) while `contacts` are closed, ∂(Da v)/∂q being rates_q, where all of them
  /// push clearly (ContactDynamics::PushClearly); else false. Only where there are products.
  bool Accelerate(const Vector& u, const Vector& v, ContactMode mode, const SparseRows& rates_q,
                  Vector* acceleration) const;

 private:
  struct Unit {
    SparseRows momentum_q, rates_q;
  };
  const Unit& UnitOf(int i);
  void MakeUnits();
  const SparseRows& RatesAtFirst();
  SparseRows Differentiate(const Vector& v) const;

  const MechanicalSystem& system_;
  const Variables variables_;
  const Vector q_, v_minus_;
  const ConstraintSet contacts_;  // that may get an impulse
  std::shared_ptr<const InverseInertia> inertia_;
  std::shared_ptr<const SparseRows> jacobian_;
  Vector mobility_;
  bool products_ = false;
  SparseRows rates_minus_;  // at v⁻
  std::map<int, Unit> units_;
};

}  // namespace contact_flow
