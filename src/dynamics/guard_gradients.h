// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The Guards of a mode at one state with their gradients by w = (δq, δv, δu, δp) [2d+k]:
///   gap     ±(Da_i, 0, 0, ∂a_i/∂p)
///   force   Dλ_n,i
///   cone    D(μ λ_n ± λ_t), D(μ λ_n − |λ_t|), or that of the margin of shared forces
///   slip    ±D(T v), and D|T v| = ŝᵀ D(T v) in space, ŝ = T v/|T v|.
///
/// At the end of a slip s = T v in space, which is no change of sign, friction turns with
/// ŝ: forces have derivatives of size 1/|s| across ŝ. Along the run ŝ has a limit, and
/// they do not act; the gradients of forces are given without them. The guard that ends is |s|.
class GuardGradients {
 public:
  struct Value {
    double value;
    Eigen::RowVectorXd gradient;  ///< [2d+k]
  };

  /// At x in `mode`; `trigger` is the guard whose event happens there, −1: none. Where no contact
  /// has friction the dynamics, which must outlive it, are asked when a force or the field is.
  GuardGradients(ContactDynamics* dynamics, const VectorRef& x, const ContactMode& mode,
                 int trigger = -1);

  Value At(int guard) const;
  /// The guards that are functions of forces.
  ConstraintSet forces() const { return guards_.OfForces(mode_, shared_); }
  /// Whether the trigger is the end of a slip in space.
  bool SlipInSpaceEnds() const { return across_.size() > 0; }
  /// ẋ, and zeros for the variables [2d+k].
  const Vector& field() const {
    EvaluateForces();
    return field_;
  }

 private:
  void EvaluateForces() const;
  void DifferentiateSlips(const Vector& q, const Vector& v);
  Value OfForce(int guard) const;
  Value OfGap(int i) const;
  Value OfSlip(int guard) const;

  ContactDynamics& dynamics_;
  const Guards guards_;
  const Vector x_;
  const ContactMode mode_;
  const int d_;
  ConstraintTerms terms_;
  ParameterJacobian by_parameter_;
  // Of forces, when asked for:
  mutable bool forces_known_ = false;
  mutable ConstraintSet shared_;
  mutable Vector field_;           // [2d+k]
  mutable Vector force_;           // of guards that are functions of forces [guards]
  mutable Matrix force_gradient_;  // [guards × 2d+k]
  // Of slips:
  Vector rate_;                        // A v [n+l+r]
  Matrix rate_jacobian_;               // D(A v) [n+l+r × 2d+k]
  int ended_ = -1;                     // the trigger, if it is the end of a slip in space
  double speed_ = 0;                   // |s| of it
  Eigen::RowVectorXd along_, across_;  // D(ŝ·s), and D(e⊥·s) beside it [2d+k]
};

}  // namespace contact_flow
