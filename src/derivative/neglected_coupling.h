// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cluster_geometry.h"
#include "contact_flow/constraint_set.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/types.h"
#include "impact_lift.h"
#include "touching_frame.h"

namespace contact_flow {

/// What it costs to leave the coupling of two contacts out of a cluster, and what may be left out:
/// what an error of the located state changes anyway (ClusterReport).
class NeglectedCoupling {
 public:
  NeglectedCoupling(ContactDynamics* dynamics, const Transition& transition,
                    const TouchingFrame& frame, ClusterGeometry* geometry);

  /// What δx changes in v⁺ [d].
  const Vector& outcome_limit() const { return outcome_limit_; }
  /// κ rtol max(1, max|S⁻¹ ∂v⁺/∂v⁻ S|) with S = diag(1/√M_kk), which has no unit.
  double derivative_limit() const { return derivative_limit_; }
  /// Speeds of constraint i below this count as rest [m/s].
  double Rest(int i) const { return rest_(frame_.Row(i)); }

  /// How much the order of i and j changes v⁺, a bound [d].
  Vector Jump(int i, int j) const;
  /// … and an entry of the derivative of v⁺ by v⁻.
  double JumpOfDerivative(int i, int j) const;
  /// Both are below their limits.
  bool Orthogonal(int i, int j) const;
  /// What the impact of j, while `held` hold still, may or may not add to a derivative.
  ImpactLift LiftBy(int j, ConstraintSet held, const Vector& v) const;

 private:
  void ScaleDerivatives(const MatrixRef& reset);
  /// S⁻¹ D S, D = ∂v⁺/∂v⁻ or ∂v⁺/∂q.
  Matrix Scaled(const MatrixRef& D) const;
  Vector Response(int hit, int other) const;
  /// … of diag(scale)⁻¹ ∂v⁺/∂v⁻ diag(scale).
  double ResponseOfDerivative(int hit, int other, const Vector& scale) const;

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Transition& transition_;
  const TouchingFrame& frame_;
  ClusterGeometry& geometry_;
  const Vector q_;
  Vector impulse_;  // the largest that a contact may get [k]
  Vector outcome_limit_;
  Vector rest_;  // [k]
  double derivative_limit_ = 0;
  double relative_ = 0;  // κ rtol
  Vector scale_;         // of S [d]
  double hurry_ = 0;     // |q̈| before the impacts, in the kinetic metric
};

}  // namespace contact_flow
