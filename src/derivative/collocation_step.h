// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/LU>
#include <memory>

#include "collocation_rule.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// One step of collocation for few tangents of ÿ = K y + D ẏ + S (δu, δp), forward,
/// and the same step transposed. The accelerations at its nodes,
///   Y_i = K_i (y + c_i h ẏ + h² Σ_j (a²)_ij Y_j) + D_i (ẏ + h Σ_j a_ij Y_j) + S_i (δu, δp),
/// are found by a factorization, which is kept; where there are many, by iteration, which needs no
/// more than products with K_i and D_i and converges fast where the step is short beside 1/√|K| and
/// 1/|D|. Both ways lead to the solution to rounding, so that the transposed step is the transpose.
class CollocationStep {
 public:
  /// Systems of up to this many unknowns are factorized at once: about ten solutions are asked of a
  /// step, which take as many rounds each.
  static constexpr int kDirect = 200;

  CollocationStep(int d, int k, const CollocationRule& rule, double h);

  /// [K_i D_i] [d×2d] and S_i [d×k] at node i, to be filled.
  Eigen::Map<Matrix> Node(int i) { return {nodes_.data() + i * 2 * d_ * d_, d_, 2 * d_}; }
  Eigen::Map<Matrix> Source(int i) { return {sources_.data() + i * k_ * d_, d_, k_}; }
  /// What a running cost changes with (y, ẏ) at the nodes, weights of the rule included [2d×s].
  void SetCost(Matrix gradients) { cost_ = std::move(gradients); }
  const CollocationRule& rule() const { return *rule_; }
  double length() const { return h_; }

  /// For the columns w [2d+k × c] at its beginning the accelerations at the nodes [d × s c], node
  /// by node. False where they are not determined.
  bool Solve(const Matrix& w, Matrix* accelerations) const;
  /// (y, ẏ) [2d×c] at a point of the step, `once` and `twice` being its weights.
  Matrix Tangents(const Matrix& w, const Matrix& accelerations, double at, const Vector& once,
                  const Vector& twice) const;
  /// Σ_j weights_j Y_j [d×c].
  Matrix Accelerations(const Matrix& accelerations, const Vector& weights) const;
  /// w ← (y, ẏ, δu, δp) at its end.
  void Advance(Matrix* w, const Matrix& accelerations) const;
  /// λ [2d+k] at its beginning for λ at its end: Φᵀ λ and the gradient of the running cost. False
  /// where it is not determined.
  bool Retreat(Vector* lambda) const;

 private:
  const Eigen::PartialPivLU<Matrix>& Factor() const;

  int d_;
  int k_;
  const CollocationRule* rule_;
  double h_;
  Matrix nodes_;    // [K_i D_i], i = 1 … s, side by side
  Matrix sources_;  // S_i, likewise
  Matrix cost_;     // [2d×s], or empty
  mutable std::shared_ptr<const Eigen::PartialPivLU<Matrix>> factor_;  // where iteration failed
};

}  // namespace contact_flow
