// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/rigid_body_tree.h"

namespace contact_flow {

/// M = Lᵀ D L with L unit lower triangular, without fill: L(j, i) ≠ 0 only where i is on j's way to
/// the root (Featherstone 2008, Sec. 6.5). Works in place on the upper triangle of M [nv×nv], which
/// then holds D and Lᵀ. The tree must outlive it.
class TreeFactor {
 public:
  explicit TreeFactor(const RigidBodyTree& tree) : tree_(&tree) {}

  /// −1, or a number without inertia: M is not positive definite to working precision, its pivot is
  /// below 1e-13 of the diagonal element it started from, where rounding has left nothing of it.
  int Compute(Matrix* mass) const;
  /// x ← M⁻¹ x, for each column of x [nv×k].
  void Solve(const Matrix& factor, Eigen::Ref<Matrix> x) const;

 private:
  const RigidBodyTree* tree_;
};

}  // namespace contact_flow
