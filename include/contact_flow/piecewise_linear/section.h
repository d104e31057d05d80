// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/types.h"

/// What turns the B-derivative of an outcome into the derivative of a map of a section into itself:
/// all of it from maps to maps.
namespace contact_flow {

/// Orthonormal basis [n×k] of {w : rows·w = 0}; singular values below 1e-9 of the largest are zero.
Matrix NullSpace(const MatrixRef& rows);

/// The orthonormal basis of the span of `basis` that is nearest to `other`, of the same size: basis
/// U Vᵀ with basisᵀ other = U Σ Vᵀ.
Matrix NearestBasis(const MatrixRef& basis, const MatrixRef& other);

/// w ↦ endᵀ f(start z): f in orthonormal bases [r×p] of the end and [c×q] of the start. Pieces that
/// have no interior there are left out.
PiecewiseLinearMap InBases(const PiecewiseLinearMap& map, const MatrixRef& end,
                           const MatrixRef& start);

/// First-order time to the section {s = 0} from the outcome f(w): −ds f(w) / (ds F), one row.
/// `gradient` is ds and `field` F, both [r], at the point where the section is crossed. Throws
/// std::invalid_argument for ds F = 0.
PiecewiseLinearMap CrossingTime(const PiecewiseLinearMap& map, const VectorRef& gradient,
                                const VectorRef& field);

/// DP = (I − F ds / (ds F)) f: the outcome where it crosses the section instead of at a fixed time.
PiecewiseLinearMap OntoSection(const PiecewiseLinearMap& map, const VectorRef& gradient,
                               const VectorRef& field);

/// A square map on a smaller space, with the largest violation of what makes it one.
struct ReducedMap {
  PiecewiseLinearMap map;  ///< of coordinates of the section
  Matrix basis;            ///< orthonormal [n×k]; a tangent w becomes basisᵀ w
  double residual = 0;     ///< 0 when the reduction is exact; relative to the largest matrix entry
};

/// f restricted to the span of `subspace` [n×k], which it must map into itself: f(w) = V z.
/// residual is the largest entry of (I − V Vᵀ) A_i V over the pieces that meet the span.
ReducedMap RestrictToInvariant(const PiecewiseLinearMap& map, const MatrixRef& subspace);

/// f modulo the span of `neutral` [n×k], of the form f(w + N c) = f(w) + N J c with J one matrix
/// whose eigenvalues are all 1: symmetries such as a horizontal translation, and the velocity along
/// it. The quotient is represented on the orthogonal complement. residual is the largest entry of
/// (I − N Nᵀ) A_i N and of C_i N, of the differences of the J_i, and of the traces of (J − I)ʲ:
/// neutral directions must stay neutral, must not decide between cones, and must not grow or
/// shrink, as the quotient does not know of that. Of a map f(w, u) with more columns than rows
/// these are inputs u, and stay.
ReducedMap SetAside(const PiecewiseLinearMap& map, const MatrixRef& neutral);

}  // namespace contact_flow
