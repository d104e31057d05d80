// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <optional>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// min gᵀd + ½ dᵀH d  with  lower ≤ d ≤ upper,  A d + b ≥ 0,  and = 0 in the rows of `equal`.
struct QuadraticProgram {
  const Eigen::LLT<Matrix>& H;  ///< [n×n], positive definite
  const Vector& g;              ///< [n]
  Vector lower, upper;          ///< [n], infinite where there is none; equal: an equality
  Matrix A;                     ///< [m×n]
  Vector b;                     ///< [m]
  std::vector<bool> equal;      ///< [m]
};

/// What it takes: H d + g = Aᵀ z + ζ, z ≥ 0 but for equalities, ζ of the bounds.
struct QuadraticSolution {
  Vector d, multipliers;      ///< [n], z [m]
  std::vector<bool> bounded;  ///< entries that are held at a bound [n]
};

/// Why there is none.
enum class QuadraticFailure {
  kContradiction,  ///< the constraints exclude each other
  kNotFinite,      ///< a number is none
  kUnfinished,     ///< too many active sets were tried
};

/// By the dual active set of Goldfarb and Idnani (Math. Prog. 27, 1983): from the minimum without
/// constraints, one violated constraint after another becomes active, O(n²) each.
/// Nothing where there is no solution, with the reason in `why`.
[[nodiscard]] std::optional<QuadraticSolution> Solve(const QuadraticProgram& program,
                                                     QuadraticFailure* why = nullptr);

}  // namespace contact_flow
