// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// Orthonormal basis [2d+k×·] of the tangents (δq, δv, δu, δp) that the contact mode of x admits.
Matrix AdmissibleBasis(const MechanicalSystem& system, const VectorRef& x, ContactMode mode,
                       const Variables& variables);

/// Moves x by the shortest change in (q, v) onto a_i = 0, Da_i v = 0 for the rigid members of the
/// mode and the bilateral constraints. Leaves x where Newton's method finds nothing.
void Retract(const MechanicalSystem& system, ContactMode mode, Vector* x);

}  // namespace contact_flow
