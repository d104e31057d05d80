// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/constraint_set.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// ∂p/∂(q, v⁻) [n × 2d] of the impulses of the contacts in `hit`, zero rows for others: what
/// remains of M (v⁺ − v⁻) = Aᵀ p, differentiated, once ∂v⁺ is known. Arguments as of
/// ImpactJacobian; throws as that does, and std::domain_error where p is not unique.
Matrix ImpulseJacobian(const MechanicalSystem& system, const InverseInertia& inertia,
                       const VectorRef& q, const VectorRef& v_minus, const ImpactResult& result,
                       const ConstraintSet& hit, const ConstraintSet& persisting);

}  // namespace contact_flow
