// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/inverse_inertia.h"

namespace contact_flow {

/// What is the same after all impacts of a cluster, at its configuration ρ: M, its factor, Da, G.
///
/// The derivatives of an impact by q are linear in what it does,
///   ∂(M Δv − Daᵀ p)/∂q in (Δv, p),      ∂(Da v)/∂q in v,
/// so that those of a unit impulse of each contact, with the jump M⁻¹Da_iᵀ that it makes, tell all.
class ClusterGeometry {
 public:
  ClusterGeometry(const MechanicalSystem& system, const Vector& q, const Vector& v);

  const std::shared_ptr<const InverseInertia>& inertia() const { return inertia_; }
  /// Of an impact that begins with ∂(Da v)/∂q = before_q: ∂r₁/∂q, and ∂(Da v⁺)/∂q.
  void DifferentiateImpact(const ImpactResult& impact, const Matrix& before_q, Matrix* momentum_q,
                           Matrix* after_q);
  /// v̇ [d] at (ρ, v) while `contacts` are closed, ∂(Da v)/∂q being rates_q, where all of them
  /// push clearly (ContactDynamics::PushClearly); else false.
  bool Accelerate(const Vector& u, const Vector& v, ContactMode mode, const MatrixRef& rates_q,
                  Vector* acceleration) const;

 private:
  struct Unit {
    Matrix momentum_q, rates_q;
  };
  const Unit& UnitOf(int i);

  const MechanicalSystem& system_;
  const Vector q_;
  std::shared_ptr<const InverseInertia> inertia_;
  std::map<int, Unit> units_;
};

}  // namespace contact_flow
