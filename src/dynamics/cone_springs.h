// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/types.h"
#include "dependent_rows.h"

namespace contact_flow {

/// Forces of equal springs, infinitely stiff, that keep their cones: λ = proj(A w), where the w of
/// the bodies is such that H λ = rows · right. A spring that would pull carries nothing; one that
/// would push out of its cone creeps along the cone while others hold the body.
struct ConeSprings {
  const Matrix& H;      ///< [r×k]
  const Matrix& range;  ///< columns that span those of A [k×r]
  const Matrix& rows;   ///< [r×k]
  const std::vector<ForceCone>& cones;
};

/// The map from `right` to λ near this right side, and at it: they are homogeneous [k×k]. Empty
/// where no such forces were found.
Matrix SolveConeSprings(const ConeSprings& springs, const Vector& right);

}  // namespace contact_flow
