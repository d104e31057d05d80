// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Solution of a linear complementarity problem.
struct ComplementaritySolution {
  bool found = false;   ///< false: G is not positive definite (or not finite)
  Vector z;             ///< [n]
  ContactMode support;  ///< the indices solved as w_i = 0; z vanishes off it
};

/// Solves 0 ≤ z ⟂ w = G z + b ≥ 0 for symmetric positive definite G [n×n]; z is unique. By Murty's
/// least-index principal pivoting (K. G. Murty, Linear Complementarity, 1988, Sec. 4.1), which is
/// finite for every P-matrix and one step per hit for a diagonal G: z_i = max(0, −b_i/G_ii). Signs
/// are judged up to rounding, 1e-13 times the largest |b_i|: a smaller violation counts as zero.
ComplementaritySolution SolveComplementarity(const Matrix& G, const Vector& b);

}  // namespace contact_flow
