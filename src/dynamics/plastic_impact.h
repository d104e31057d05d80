// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/constraint_set.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// The bilateral plastic impact on the constraints in J, Δ_J of (1b) at γ = 0, whatever
/// their restitution:
///   v⁺ = v⁻ + M⁻¹ Da_Jᵀ p,   p = −(Da_J M⁻¹ Da_Jᵀ)⁻¹ Da_J v⁻,
/// after which Da_J v⁺ = 0; p is the shortest where rows of Da_J are dependent. It stands for
/// infinitely many bounces in a vanishing time. Throws std::domain_error where v⁺ is not finite.
ImpactResult PlasticImpact(const MechanicalSystem& system, const VectorRef& q,
                           const VectorRef& v_minus, const ConstraintSet& J);

}  // namespace contact_flow
