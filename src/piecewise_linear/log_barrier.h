// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/types.h"

namespace contact_flow {

/// Σ −log det S_i(y) of matrices S_i affine in y, at one y: its gradient and Hessian, summed up
/// matrix by matrix, and Newton's step, which stays where all S_i > 0.
class LogBarrier {
 public:
  /// Of y ∈ ℝᴺ. Room is asked of the budget first; `purpose` names it.
  LogBarrier(Eigen::Index unknowns, int largest_matrix, const std::string& purpose);

  /// Adds −log det S. Column k of `directions` is R (∂S/∂y_k) Rᵀ, R S Rᵀ = I [s·s×N].
  void Add(const Matrix& directions);
  /// Adds ½ ε |y_k|² for some of the unknowns.
  void AddSquares(const VectorRef& y, Eigen::Index first, Eigen::Index count, double epsilon);

  /// The Newton decrement, and the damped step: it stays inside, the barrier being self-concordant.
  /// NaN, and no step, where the Hessian is not positive definite. Once for each sum.
  double Step(Vector* step);

 private:
  Vector gradient_;
  Matrix hessian_;
};

}  // namespace contact_flow
