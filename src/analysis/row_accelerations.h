// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// d/dt (A v) = A v̇ + Ȧ v of all rows A = (Da, Db, T) along the motion of a mode at one state, also
/// of rows that the mode does not hold: how gaps and slips that are at rest begin to move.
class RowAccelerations {
 public:
  RowAccelerations(ContactDynamics* dynamics, const VectorRef& x, ContactMode mode);

  double At(int row) const { return value_(row); }
  /// The size of what it is the sum of.
  double Terms(int row) const { return terms_(row); }
  /// By w = (δq, δv, δu, δp) [2d+k].
  Eigen::RowVectorXd Gradient(int row) const { return gradient_.row(row); }
  /// d/dt of it along the mode.
  double Rate(int row) const { return gradient_.row(row).dot(field_); }

 private:
  Vector value_, terms_;  // [n+l+r]
  Matrix gradient_;       // [n+l+r × 2d+k]
  Vector field_;          // [2d+k]
};

}  // namespace contact_flow
