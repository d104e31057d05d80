// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Guards at one state and their gradients by it, for the events that happen there.
///
/// At the end of a slip s = T v in space, which is no change of sign, friction turns with
/// ŝ = s/|s|: forces have derivatives of size 1/|s| across ŝ. Along the run ŝ has a limit, and
/// they do not act; the gradients of forces are given without them. The guard that ends is |s|.
class GuardGradients {
 public:
  struct Value {
    double value;
    Eigen::RowVectorXd gradient;  ///< [2d]
  };

  /// At x in `mode`; `trigger` is the guard whose event it is.
  GuardGradients(ContactDynamics* dynamics, const Vector& x, ContactMode mode, int trigger);

  Value At(int guard) const;
  /// The guards that are functions of forces.
  ConstraintSet forces() const { return forces_; }
  /// Whether the trigger is the end of a slip in space.
  bool SlipInSpaceEnds() const { return across_.size() > 0; }
  /// ẋ [2d].
  const Vector& field() const { return field_; }

 private:
  const Guards guards_;
  const ContactMode mode_;
  ConstraintSet forces_;
  int ended_ = -1;  // the trigger, if it is the end of a slip in space
  Vector field_, rate_;
  Vector force_;           // of guards that are functions of forces
  Matrix force_gradient_;  // … by the state [· × 2d]
  Matrix rate_jacobian_;   // D(A v) [n+l+r × 2d]
  ConstraintTerms terms_;
  double speed_ = 0;                   // |s| of it
  Eigen::RowVectorXd along_, across_;  // D(ŝ·s), and D(e⊥·s) beside it [2d]
};

}  // namespace contact_flow
