// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/constraint_set.h"
#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Which reading of (1b) decides an impact.
enum class ImpactLaw {
  /// p ≥ 0, Da v⁺ + γ Da v⁻ ≥ 0, complementary (Newton–Moreau): only approaching constraints are
  /// hit, and a contact that would have to pull lets go.
  kComplementarity,
  /// The paper's literal projection Δ_J with J = {j : a_j = 0}: every touching constraint gets the
  /// bilateral impulse, whatever its sign.
  kProjection,
};

/// The outcome of an impact at configuration ρ.
struct ImpactResult {
  Vector v_plus;      ///< v⁺ [d]
  Vector impulse;     ///< p, then r [n+l], p zero off the touching set
  ConstraintSet hit;  ///< constraints with p_i ≠ 0
};

/// Impact (1b) at ρ over the touching rigid constraints K:
///   M (v⁺ − v⁻) = Da_Kᵀ p + Dbᵀ r,   0 ≤ p ⟂ Da_K v⁺ + γ Da_K v⁻ ≥ 0,   Db v⁺ = 0.
/// Throws std::domain_error where no such p exists, or v⁺ is not finite.
ImpactResult SolveImpact(const MechanicalSystem& system, const VectorRef& q,
                         const VectorRef& v_minus, const ConstraintSet& touching,
                         ImpactLaw law = ImpactLaw::kComplementarity);

class InverseInertia;
/// The same where P at ρ is known.
ImpactResult SolveImpact(const MechanicalSystem& system, const InverseInertia& inertia,
                         const VectorRef& v_minus, const ConstraintSet& touching, ImpactLaw law);

/// The velocity [d] after a generalized impulse p [d] from outside: v + P p (InverseInertia), then
/// the impact of all rigid constraints that touch, a_i ≤ gap_tolerance [m].
Vector PushedVelocity(const MechanicalSystem& system, const VectorRef& x, const VectorRef& impulse,
                      double gap_tolerance, ImpactLaw law = ImpactLaw::kComplementarity);

/// Derivative DR [2d+k × 2d+k] of the reset R(q, v) = (q, v⁺), where the constraints in `hit`
/// receive the impulse (for those in `persisting` ⊂ hit the restitution is void: they rest before
/// and after), by the implicit function theorem on the residual of (1b):
///   DR = [[I, 0, 0], [∂v⁺/∂q, ∂v⁺/∂v⁻, ∂v⁺/∂(u, p)], [0, 0, I]].
/// `inertia` is that at q. Throws std::domain_error where DR is not finite.
Matrix ImpactJacobian(const MechanicalSystem& system, const InverseInertia& inertia,
                      const VectorRef& q, const VectorRef& v_minus, const ImpactResult& result,
                      const ConstraintSet& hit, const ConstraintSet& persisting,
                      const Variables& variables = {});

}  // namespace contact_flow
