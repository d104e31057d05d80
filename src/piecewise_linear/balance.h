// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Sizes d of the states of a map (x, w) ↦ x⁺, by the map itself: with x = d z what each z_j gives
/// to the others and what it gets from them add up to the same over the largest entries of all
/// pieces. Other units of x give sizes in these, up to a common factor. States between which
/// nothing passes, or only one way, are not moved further apart than by a part of the whole.
Vector BalancedSizes(const PiecewiseLinearMap& map);

/// How much the inputs w of such a map do: the longest column of all pieces for each; 1 where an
/// input has no effect.
Vector EffectsOfInputs(const PiecewiseLinearMap& map);

/// The map in y = to⁻¹ f and z = from⁻¹ w, one size for each; with unit rows again. Exact but for
/// rounding in each entry.
PiecewiseLinearMap InSizes(const PiecewiseLinearMap& map, const Vector& to, const Vector& from);

/// P or T of a norm in z = x / sizes, as one of x: S⁻¹ P S⁻¹ or T S⁻¹.
Matrix FormInUnits(const Matrix& P, const Vector& sizes);
Matrix RowsInUnits(const Matrix& T, const Vector& sizes);

}  // namespace contact_flow
