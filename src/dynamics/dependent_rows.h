// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// Independent rows among rows A whose Gram matrix G = A P Aᵀ [k×k] is given, by Cholesky's method
/// with pivots; what is left of a row, relative, is up to kDependentRow that of a dependent one.
struct RowBasis {
  std::vector<int> rows;  ///< independent, in increasing order
  Matrix inverse;         ///< (G_BB)⁻¹ on those rows, zero elsewhere [k×k]: G inverse G = G
  Matrix freedom;         ///< Z [k×f] with Aᵀ Z = 0, one column for each of the other rows

  /// The inverse of Moore and Penrose: λ = G⁺ r is the shortest of all with G λ = r.
  Matrix PseudoInverse() const;
};
RowBasis FindRowBasis(const Matrix& G);

/// Whether the least eigenvalue of G, with rows and columns in units of their own, is rounding.
bool HasDependentRows(const Matrix& G);

/// A basis of forces that do not push, in units of the rows, with entries that are rounding, or the
/// errors of gaps, made zero: two points without slip, one a little higher, do not jam.
Matrix WithoutRounding(const Matrix& freedom);

/// What a force has to keep: λ(normal) ≥ 0, and with a finite coefficient μ
/// |λ(tangential, …)| ≤ μ λ(normal).
struct ForceCone {
  int normal, tangential, dimension;  ///< places in λ; of 0 to 2 tangential ones
  double coefficient;
  double weight = 1;  ///< of the margin
};

/// The least of μ λ_n − |λ_t|, or λ_n, of all cones.
double LeastSlack(const std::vector<ForceCone>& cones, const Vector& force);

/// How forces that are not unique may be shared: λ = force + Z ν.
struct ForceShare {
  double margin = 0;  ///< max over ν of min over cones (μ λ_n − |λ_t|, or λ_n) / weight
  Vector force;       ///< there
  Vector gradient;    ///< of the margin by λ, with Zᵀ gradient = 0
};
/// The share that is farthest inside the cones. The margin is negative where no admissible one
/// exists; no larger than 10 times the force, beyond which it does not matter.
ForceShare MostInterior(const std::vector<ForceCone>& cones, const Vector& force,
                        const Matrix& freedom);

/// The admissible share with the smallest sum of squares; the most interior one where that is
/// hardly admissible. `force` is the smallest of all.
Vector SmallestShare(const std::vector<ForceCone>& cones, const Vector& force,
                     const Matrix& freedom, const ForceShare& interior);

}  // namespace contact_flow
