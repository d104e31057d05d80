// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/constraint_set.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Impacts (1b) over subsets of the k contacts that touch at one configuration, with what they
/// share: A = Da [k×d], Y = P Aᵀ [d×k], G = A Y [k×k], P as in InverseInertia.
class TouchingFrame {
 public:
  TouchingFrame(const MechanicalSystem& system, const InverseInertia& inertia,
                ConstraintSet touching, ImpactLaw law);

  /// The same as SolveImpact. Throws std::domain_error for dependent constraints.
  ImpactResult Impact(const Vector& v, ConstraintSet subset) const;
  /// The row of constraint i, which touches.
  int Row(int i) const { return row_[static_cast<std::size_t>(i)]; }
  std::vector<int> Rows(ConstraintSet subset) const;
  double Rate(int i, const Vector& v) const { return A.row(Row(i)).dot(v); }
  double Restitution(int i) const { return restitution_(i); }
  /// Y_i and G_ij where the contacts in `held` hold still: Y_i − Y_H G_HH⁻¹ G_Hi, ….
  Vector HeldResponse(int i, ConstraintSet held) const;

  ConstraintSet touching;
  ImpactLaw law;
  Matrix A, Y, G;

 private:
  Vector restitution_;
  Matrix reaction_;  // of the bilateral constraints, per impulse, and none of friction [l+r×k]
  std::vector<int> row_;
  int num_constraints_;
};

}  // namespace contact_flow
