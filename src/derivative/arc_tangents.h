// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "arc_jacobian.h"
#include "collocation_step.h"
#include "contact_flow/derivative/run_cost.h"
#include "contact_flow/derivative/variation.h"

namespace contact_flow {

/// The variational equation of one arc (variation.h) in steps that are kept, for few tangents
/// forward and few covectors backward: products with Φ and Φᵀ that cost no more than the Jacobians
/// on the way, where Φ itself costs a solution for each column. Steps and order are chosen as
/// there, by the defects of tangents that have a part in all directions and by the flow law; where
/// a running cost is given, also by how well the nodes resolve it. Refuses as PropagateArc does.
class ArcTangents {
 public:
  /// `cost` may be null, or without running cost.
  ArcTangents(ContactDynamics* dynamics, const Arc& arc, double tolerance, const RunCost* cost,
              VariationStatistics* statistics);

  /// columns ← Φ columns [2d+k × ·].
  void Forward(Matrix* columns) const;
  /// λ ← Φᵀ λ + the gradient of the arc's running cost [2d+k].
  void Backward(Vector* lambda) const;

  /// What is known at one end of the arc.
  struct End {
    Vector field;     ///< (v, v̇) [2d]
    double rate = 0;  ///< l
  };
  const End& begin() const { return begin_; }
  const End& end() const { return end_; }
  double cost() const { return cost_; }    ///< ∫ l dt
  double drift() const { return drift_; }  ///< ∫ ∂l/∂t dt

 private:
  friend class ArcTangentsMaker;
  void Make(ContactDynamics* dynamics, const Arc& arc, double tolerance, const RunCost* cost,
            VariationStatistics* statistics);

  int d_;
  std::vector<CollocationStep> steps_;
  Vector unit_;           // of (y, ẏ, variables) [2d+k]
  Matrix bracket_begin_;  // ad_v where there are rotations, else empty
  Matrix bracket_end_;
  Vector by_variables_;  // of the running cost [k]
  End begin_, end_;
  double cost_ = 0, drift_ = 0;
  double t_begin_, t_end_;
};

}  // namespace contact_flow
