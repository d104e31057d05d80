// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/inverse_inertia.h"

namespace contact_flow {

/// A row of A that comes to rest, and along what its impulse pushes.
struct RestingRow {
  int row;      // of the system [n+l+r]
  Vector push;  // column of W: N_iᵀ − μ T_iᵀ d of what slips along d, else the row itself [d]
};

/// The rows that the contacts of a mode bring to rest: normal ones, and slips of those that stick.
/// Slips in space have the directions of v.
std::vector<RestingRow> RestingRows(const MechanicalSystem& system, const Matrix& A,
                                    const VectorRef& v, const ContactMode& mode);

/// What contacts come to that bounce ever lower until they move in a mode:
///   M (v⁺ − v) = W p,   A v⁺ = 0 of these rows.
/// Whatever the bounces were, as long as no slip turns: v⁺ depends on the sum p of all alone.
struct RestImpulse {
  Vector v_plus;  ///< v⁺ [d]
  Vector
      impulse;  ///< p by rows of the system, what slips and bilateral constraints with it [n+l+r]
};

/// v⁺ is NaN where the rows cannot come to rest.
RestImpulse BringToRest(const MechanicalSystem& system, const InverseInertia& inertia,
                        const VectorRef& v, const ContactMode& mode);

}  // namespace contact_flow
