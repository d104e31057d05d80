// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// The rows of a matrix as fixed combinations of a few of them, to rounding:
///   row i = Σ_l combination(i, l) · row members[l].
class RowSpan {
 public:
  /// Takes every row for independent.
  void SetAll(int rows);
  /// Of the matrix *sample, which is used up: elimination of columns with complete pivoting.
  void Find(Matrix* sample);
  /// Whether the same combinations give the rows of another matrix, each of `length` entries, (i,
  /// k) at data[i·row_stride + k·stride]; what is below `zero` counts as rounding.
  bool Holds(const double* data, int row_stride, int length, int stride, double zero) const;

  int size() const { return static_cast<int>(members_.size()); }
  const std::vector<int>& members() const { return members_; }
  const Matrix& combination() const { return combination_; }

  /// Part of the largest entry that counts as rounding.
  static constexpr double kRounding = 1e-13;

 private:
  void FindDependent();

  std::vector<int> members_;
  std::vector<int> dependent_;  // the other rows
  Matrix combination_;
};

/// The independent rows and columns of a Jacobian [K D] all along a step: a contact stops a
/// coordinate or couples some, a momentum is conserved (rows), a translation changes nothing
/// (columns, alike in K and D).
class JacobianSpan {
 public:
  const RowSpan& rows() const { return rows_; }
  const RowSpan& columns() const { return columns_; }

  void SetAll(int d);
  /// Of some [K D], d×2d each, side by side; the rows also of `sources` [d×·], more
  /// right-hand sides.
  void Find(const MatrixRef& sample, const MatrixRef& sources);
  /// Whether the same holds for others, side by side, whose largest entry is `largest`.
  bool Holds(const MatrixRef& nodes, double largest, const MatrixRef& sources) const;

 private:
  RowSpan rows_;
  RowSpan columns_;
  Matrix scratch_;
};

}  // namespace contact_flow
