// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "collocation_rule.h"
#include "contact_flow/types.h"
#include "row_span.h"

namespace contact_flow {

/// One step of collocation for the tangents of ÿ = K y + D ẏ + S (δu, δp): from
/// [K_i D_i] [d×2d] and S_i [d×k] at the nodes, their accelerations Y_i [d × 2d+k] there.
class Collocation {
 public:
  Collocation(int d, int k);

  /// What is below RowSpan::kRounding of the largest entry counts as rounding, and is lost: over a
  /// step kRounding · |h D + h² K| of a tangent. Where that is more than `part` of it all rows are
  /// kept. A slip that begins in space turns at up to 1e12/s and more, a hard servo at 1e7/s: then
  /// the largest entry is no measure of what others do. Steps of motion that is not stiff reach
  /// kOrdinary at most, and lose nothing that counts.
  void LoseAtMost(double part) { quick_ = std::max(part / RowSpan::kRounding, kOrdinary); }
  /// Before a step: its rule.
  void SetRule(const CollocationRule& rule) { rule_ = &rule; }
  const CollocationRule& rule() const { return *rule_; }
  /// [K_i D_i] at node i, to be filled.
  Eigen::Map<Matrix> Node(int i) { return {nodes_.data() + i * 2 * d_ * d_, d_, 2 * d_}; }
  /// … and S_i.
  Eigen::Map<Matrix> Source(int i) { return {sources_.data() + i * k_ * d_, d_, k_}; }
  /// The spans to begin with; later steps take those of the step before where they hold.
  void FindSpan(const MatrixRef& jacobian, const MatrixRef& sources) {
    span_.Find(jacobian, sources);
  }
  /// The independent rows and columns.
  int num_rows() const { return rows_.size(); }
  int num_columns() const { return columns_.size(); }

  /// Solves a step of length h [s]; false when the linear system is singular.
  bool Solve(double h);
  /// The propagator of the step solved [2d+k × 2d+k].
  void Propagator(double h, Matrix* step);
  /// target += scale · Σ_j weights_j Y_j = scale · R (Σ_j weights_j Z_j) Cᵀ  [d × 2d+k].
  void AddAccelerations(double scale, const Vector& weights, Eigen::Ref<Matrix> target);

  /// From here on one tangent alone, which begins the step as r [2d+k]: costs a product, where the
  /// whole propagator costs many.
  void Follow(const VectorRef& r);
  /// Its acceleration Σ_j weights_j Y_j r [d].
  void Acceleration(const Vector& weights, Vector* acceleration);
  /// Its (y, ẏ) [2d] at a point of the step.
  void Tangent(double h, const CollocationRule::Point& point, Vector* tangent);

 private:
  static constexpr double kOrdinary = 5;

  /// Only independent rows and columns enter the linear system. What holds on one step mostly does
  /// on the next.
  void FindSpans(double h);
  /// The largest entry of h D + h² K at the nodes, or more.
  double Reach(double h) const;
  /// Fills the linear system for the accelerations Y_i of the tangents at the nodes,
  ///   Y_i = K_i (Q₀ + c_i h V₀ + h² Σ_j (a²)_ij Y_j) + D_i (V₀ + h Σ_j a_ij Y_j),  Q₀ = [I 0], V₀
  ///   = [0 I],
  /// over the independent rows and columns: Y_i = R Z_i Cᵀ; variables have a source of their own.
  void Assemble(double h);
  /// The block row of node i; `m` is the number of independent rows, a compile-time
  /// constant when small.
  template <class Rows>
  void AssembleNode(int i, double h, Rows m);
  /// Replaces the right-hand side in accelerations_ by the solution; false when the
  /// system is singular.
  bool SolveAccelerations();

  const int d_;
  const int k_;
  const CollocationRule* rule_ = nullptr;
  Matrix nodes_;    // [K_i D_i], i = 1 … s, side by side
  Matrix sources_;  // the variables' parts, likewise
  Matrix system_matrix_;
  JacobianSpan span_;
  double quick_ = 0;                          // where |h D + h² K| is larger all rows are kept …
  bool kept_all_ = false;                     // … as they were on the last step
  const RowSpan& rows_ = span_.rows();        // R
  const RowSpan& columns_ = span_.columns();  // C
  Matrix sample_;
  Matrix source_sample_;
  Matrix picked_;         // the independent rows of one [K D]
  Matrix on_positions_;   // K R [rows × rows] of one node
  Matrix on_velocities_;  // D R
  Matrix accelerations_;  // Z_1 … Z_s, stacked
  Matrix sum_;            // Σ_j weights_j Z_j
  Matrix spread_;         // R times it
  Vector start_;          // the tangent that is followed
  Vector picked_column_;
  Matrix followed_;  // its Z_1 … Z_s, side by side
  Vector mixed_;     // Σ_j weights_j of them
  Vector integral_;  // R times it
};

}  // namespace contact_flow
