// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// Contacts whose gaps are zero at x within the tolerance.
ConstraintSet TouchingAt(const MechanicalSystem& system, const VectorRef& x, double gap_tolerance);

/// What tangents (δq, δv, δu, δp) keep besides the normal rows of the contact mode, unit rows
/// [·×2d+k]: the slips D(T v) of what sticks, and the gaps of what touches and is not in the mode.
Matrix HeldRows(const MechanicalSystem& system, const VectorRef& x, ContactMode mode,
                ConstraintSet touching, const Variables& variables = {});

/// Orthonormal basis [2d+k×·] of the tangents (δq, δv, δu, δp) that the contact mode of x admits,
/// that keep HeldRows and that make rows·w zero; `rows` [·×2d] are of (δq, δv).
Matrix AdmissibleBasis(const MechanicalSystem& system, const VectorRef& x, ContactMode mode,
                       const Variables& variables, ConstraintSet touching = {},
                       const Matrix& rows = Matrix());

/// Moves x by the shortest change in (q, v) onto a_i = 0, Da_i v = 0 for the rigid members of the
/// mode and the bilateral constraints, T_i v = 0 of what sticks and a_i = 0 of what touches. Leaves
/// x where Newton's method finds nothing.
void Retract(const MechanicalSystem& system, ContactMode mode, Vector* x,
             ConstraintSet touching = {});

}  // namespace contact_flow
