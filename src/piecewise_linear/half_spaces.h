// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// Names hyperplanes through the origin: two unit normals that agree within a tolerance, up to
/// sign, have one number.
class Hyperplanes {
 public:
  Hyperplanes(int dimension, double tolerance);

  /// ±(k+1): hyperplane k, with its first normal or the opposite one.
  int SignedNumber(const VectorRef& normal);
  int size() const { return static_cast<int>(normals_.size()); }

 private:
  double tolerance_;
  Vector probe_;  ///< normals are sorted by their products with it
  std::vector<Vector> normals_;
  std::multimap<double, int> sorted_;
};

/// `rows` restricted to the subspace that the orthonormal `basis` spans: unit rows again, each
/// once, without those that are shorter than `tolerance` there.
Matrix Restrict(const Matrix& rows, const Matrix& basis, double tolerance);

/// The rows of both.
Matrix Stack(const Matrix& above, const Matrix& below);

/// The cone {w : rows·matrix·w ≥ 0}, by unit rows, without those that vanish.
Matrix PullBack(const Matrix& rows, const Matrix& matrix);

/// Orthonormal basis [n×n−1] of the hyperplane normal to a unit row [1×n].
Matrix BasisOf(const Matrix& normal);

/// min rows·w, +∞ without a row.
double SmallestHeight(const Matrix& rows, const Vector& w);

}  // namespace contact_flow
