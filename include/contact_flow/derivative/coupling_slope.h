// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// How fast two constraints that are orthogonal at q cease to be so where both touch: the length of
/// the gradient of G_ij/√(G_ii G_jj) along {a_i = a_j = 0} [1/m or 1/rad], by central differences
/// with an error ~1e-8 times third derivatives. Assumption 4 asks for 0. Exactly 0 where M and Da
/// are constant.
double CouplingSlope(const MechanicalSystem& system, const VectorRef& q, int i, int j);

}  // namespace contact_flow
