// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/row_layout.h"
#include "contact_flow/types.h"

namespace contact_flow {

struct DependentRow {
  Eigen::Index row;
  double part;  ///< of it that is orthogonal to those before it, beside its size
};

/// Of these rows, the one that depends most on those before it, or that is hardly there, beside the
/// `size` of each; there is one at least.
inline DependentRow MostDependent(const Matrix& of, const Vector& size) {
  Matrix rows = of.array().colwise() / size.array();
  DependentRow most = {0, 1};
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    for (int twice = 0; twice < 2; ++twice) {  // Gram-Schmidt
      rows.row(k) -= rows.row(k) * rows.topRows(k).transpose() * rows.topRows(k);
    }
    const double left = rows.row(k).norm();
    if (!(left >= most.part)) most = {k, left};
    if (left > 0) rows.row(k) /= left;
  }
  return most;
}
/// The same beside the longest of them all.
inline DependentRow MostDependent(const Matrix& of) {
  return MostDependent(of, Vector::Constant(of.rows(), of.rowwise().norm().maxCoeff()));
}

}  // namespace contact_flow
