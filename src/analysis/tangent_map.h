// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/derivative/b_derivative.h"

namespace contact_flow {

/// B as a map of (δq, δv, δu, δp) to itself [2d+k → 2d+k], the variables carried along.
PiecewiseLinearMap TangentMap(const BDerivative& B);

/// Gradient of the gap a_i by (δq, δv, δu, δp) [2d+k] at x.
Vector GapGradient(const MechanicalSystem& system, const VectorRef& x, int i,
                   const Variables& variables);

}  // namespace contact_flow
