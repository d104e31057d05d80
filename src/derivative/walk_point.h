// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// A state on the way through a cluster of events with friction, x⁻ or behind one of its impacts,
/// and what the constraints do there.
class WalkPoint {
 public:
  WalkPoint(ContactDynamics* dynamics, const Transition& transition);
  void MoveTo(const Vector& x);

  const Vector& x() const { return x_; }
  Vector v() const { return x_.tail(x_.size() - nq_); }
  const Vector& rate() const { return rate_; }                    ///< A v of all rows [n+l+r]
  const Matrix& rate_jacobian() const { return rate_jacobian_; }  ///< D(A v) [n+l+r × 2d+k]
  const Matrix& gap_jacobian() const { return gap_jacobian_; }    ///< D(a, b) [n+l+r × 2d+k]
  /// The largest acceleration of rows of the cluster without contact forces.
  double acceleration() const { return acceleration_; }
  /// What A v of a row is a sum of.
  double SizeOf(int row) const;
  /// Whether the slip of contact i vanishes.
  bool SlipVanishes(int i) const;
  /// Whether contact i leaves, or approaches: −1, 0 or 1.
  int Leaves(int i) const;

  /// Those of `among`, which are members of the mode, whose normal forces vanish in it.
  ConstraintSet Forceless(ContactMode mode, ConstraintSet among) const;
  /// Contacts that stick in the plane in the mode with the force on the border of its cone.
  ConstraintSet AtCone(ContactMode mode) const;
  /// D of what that force lacks to the border, μ λ_n − |λ_t|, of contact i [2d+k].
  Eigen::RowVectorXd ConeGradient(ContactMode mode, int i) const;

 private:
  void Measure();

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const int nq_;
  const ConstraintSet contacts_;
  const ConstraintSet struck_;  // what an impact makes slip, however slowly
  const double speed_;          // largest entry of v⁻
  Vector x_;
  ConstraintTerms terms_;
  Vector rate_;
  Matrix rate_jacobian_, gap_jacobian_;
  double acceleration_ = 0;
};

}  // namespace contact_flow
