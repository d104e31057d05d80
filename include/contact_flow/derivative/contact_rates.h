// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <memory>

#include "contact_flow/dynamics/sparse_rows.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// How the normal velocities change with the tangent w = (δq, δv, δu, δp, …) at one velocity v:
///   r_j = D(Da_j v) w = ∂(Da_j v)/∂q δq + Da_j δv + ∂(Da_j v)/∂p δp.
struct ContactRates {
  /// r_j.
  double Along(int j, const Vector& w) const {
    const Eigen::Index d = jacobian->cols();
    double rate = by_q.Dot(j, w.head(d)) + jacobian->Dot(j, w.segment(d, d));
    for (Eigen::Index c = 0; c < by_parameter.cols(); ++c) {
      rate += by_parameter(j, c) * w(first_parameter + c);
    }
    return rate;
  }
  /// The sum of the terms of r_j without their signs.
  double Terms(int j, const Vector& w) const {
    const Eigen::Index d = jacobian->cols();
    double sum = by_q.AbsDot(j, w.head(d)) + jacobian->AbsDot(j, w.segment(d, d));
    for (Eigen::Index c = 0; c < by_parameter.cols(); ++c) {
      sum += std::abs(by_parameter(j, c) * w(first_parameter + c));
    }
    return sum;
  }
  /// The row of r_j by all of w [size].
  Eigen::RowVectorXd Row(int j) const {
    const Eigen::Index d = jacobian->cols();
    Vector row = Vector::Zero(size);
    by_q.AddRow(j, 1, row.head(d));
    jacobian->AddRow(j, 1, row.segment(d, d));
    if (by_parameter.cols() > 0) {
      row.segment(first_parameter, by_parameter.cols()) = by_parameter.row(j);
    }
    return row;
  }

  SparseRows by_q;                             ///< ∂(Da v)/∂q [n+l × d]
  std::shared_ptr<const SparseRows> jacobian;  ///< Da [n+l × d]
  Matrix by_parameter;                         ///< ∂(Da v)/∂p [n+l × k], or nothing
  Eigen::Index first_parameter = 0;            ///< the place of δp in w
  Eigen::Index size = 0;                       ///< of w
};

}  // namespace contact_flow
