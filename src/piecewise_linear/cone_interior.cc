// SPDX-License-Identifier: BSD-3-Clause
#include "cone_interior.h"

#include <limits>

namespace contact_flow {

double InteriorRadius(const Matrix& cone, Vector* centre) {
  const Eigen::Index n = cone.cols();
  if (centre != nullptr) *centre = Vector::Zero(n);
  if (cone.rows() == 0) return std::numeric_limits<double>::infinity();
  // Unknowns (w, t): max t subject to cone·w − t ≥ 0.
  Matrix rows(cone.rows(), n + 1);
  rows << cone, Vector::Constant(cone.rows(), -1);
  const Vector bound = Vector::Ones(n + 1);
  const std::optional<LinearOptimum> optimum =
      LinearProgram(rows, -bound, bound).Maximize(Vector::Unit(n + 1, n));
  if (!optimum) return std::numeric_limits<double>::quiet_NaN();
  if (centre != nullptr) *centre = optimum->point.head(n);
  return optimum->value;
}

bool HasInterior(const Matrix& cone) { return !(InteriorRadius(cone) <= kSmallestInterior); }

}  // namespace contact_flow
