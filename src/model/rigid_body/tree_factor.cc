// SPDX-License-Identifier: BSD-3-Clause
#include "tree_factor.h"

namespace contact_flow {

int TreeFactor::Compute(Matrix* mass) const {
  Matrix& H = *mass;
  int massless = -1;
  // From the leaves to the root: when column k is reached, all that it carries has been taken off.
  double diagonal[RigidBodyTree::kMaxDof];
  for (int k = 0; k < tree_->dof(); ++k) diagonal[k] = H(k, k);
  for (int k = tree_->dof() - 1; k >= 0; --k) {
    const double pivot = H(k, k);
    if (massless < 0 && !(pivot > 1e-13 * diagonal[k])) massless = k;
    const double inverse = 1 / pivot;
    for (int i = tree_->dof_parent(k); i >= 0; i = tree_->dof_parent(i)) {
      const double ratio = H(i, k) * inverse;
      for (int j = i; j >= 0; j = tree_->dof_parent(j)) H(j, i) -= ratio * H(j, k);
      H(i, k) = ratio;
    }
  }
  return massless;
}

void TreeFactor::Solve(const Matrix& factor, Eigen::Ref<Matrix> x) const {
  const int n = tree_->dof();
  for (Eigen::Index c = 0; c < x.cols(); ++c) {
    double* y = x.data() + c * x.outerStride();
    for (int k = n - 1; k >= 0; --k) {  // Lᵀ y = x
      const double value = y[k];
      for (int i = tree_->dof_parent(k); i >= 0; i = tree_->dof_parent(i)) {
        y[i] -= factor(i, k) * value;
      }
    }
    for (int k = 0; k < n; ++k) {  // L x = D⁻¹ y
      double value = y[k] / factor(k, k);
      for (int i = tree_->dof_parent(k); i >= 0; i = tree_->dof_parent(i)) {
        value -= factor(i, k) * y[i];
      }
      y[k] = value;
    }
  }
}

}  // namespace contact_flow
