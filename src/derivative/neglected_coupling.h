// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/types.h"
#include "touching_frame.h"

namespace contact_flow {

/// What it costs to leave the coupling of two contacts out of a cluster, and what may be left out:
/// what an error of the located state changes anyway (ClusterReport).
class NeglectedCoupling {
 public:
  NeglectedCoupling(ContactDynamics* dynamics, const Transition& transition,
                    const TouchingFrame& frame);

  /// What δx changes in v⁺ [d].
  const Vector& outcome_limit() const { return outcome_limit_; }
  double derivative_limit() const { return derivative_limit_; }
  /// Speeds of constraint i below this count as rest [m/s].
  double Rest(int i) const { return rest_(frame_.Row(i)); }

  /// How much the order of i and j changes v⁺, a bound [d].
  Vector Jump(int i, int j) const;
  /// … and an entry of the derivative of v⁺ by v⁻.
  double JumpOfDerivative(int i, int j) const;
  /// Both are below their limits.
  bool Orthogonal(int i, int j) const;
  /// What i, at rest, adds to an entry of the derivative of v⁺ by (q, p), or not, where the impact
  /// of j does not push it at q but may around q: |Y_i/G_ii| |∇ℓ_i|, with ℓ_i = Da_i (v⁺ − v) its
  /// lift, by (q, p) along {a = 0} of J⁻, i, j and of the contacts in `held`, which hold i as well.
  double LiftDerivative(int i, int j, ContactMode held, const Vector& v) const;

 private:
  Vector Response(int hit, int other) const;
  double ResponseOfDerivative(int hit, int other) const;

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Transition& transition_;
  const TouchingFrame& frame_;
  const Vector q_;
  Vector impulse_;  // the largest that a contact may get [k]
  Vector outcome_limit_;
  Vector rest_;  // [k]
  double derivative_limit_ = 0;
};

}  // namespace contact_flow
