// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cluster_geometry.h"
#include "contact_flow/constraint_set.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/types.h"
#include "touching_frame.h"

namespace contact_flow {

/// The impact of one contact, and what it adds to the derivative of v⁺ by (q, p), or not, at
/// contacts that it does not push at q but may push around q.
class ImpactLift {
 public:
  /// Of the impact of `hit` at v, while `held` hold still.
  struct Impact {
    int hit;
    ConstraintSet held;
    Vector v;
    double hurry;     ///< |q̈| before it, in the kinetic metric
    double relative;  ///< κ rtol
  };
  struct Change {
    double entry;  ///< the largest
    double share;  ///< of its limit: what is at most 1 is neglected
  };

  /// `scale` is the diagonal of S (NeglectedCoupling).
  ImpactLift(const ContactDynamics& dynamics, const TouchingFrame& frame,
             const Transition& transition, const Vector& scale, ClusterGeometry* geometry,
             Impact impact);

  /// |Y_i/G_ii| |∇ℓ_i| of contact i, which is at rest, with ℓ_i = Da_i (v⁺ − v) its lift, by (q, p)
  /// along {a = 0} of J⁻, i, j and of the contacts in `held`, which hold i as well. The limit is
  /// κ rtol times what the impact of j gives to such entries: the largest of S⁻¹ ∂v⁺/∂q S and of
  /// |q̈| ∇a_j/(Da_j v), what a delay of the impact changes; by each parameter likewise.
  Change At(int i) const;
  const Impact& impact() const { return impact_; }

 private:
  const MechanicalSystem& system_;
  const TouchingFrame& frame_;
  const Vector& scale_;
  const Impact impact_;
  ConstraintSet fixed_;  // J⁻ and those of the impact
  double delay_ = 0;     // |q̈|/|Da_j v|
  Matrix by_q_;          // (∂v⁺/∂q)ᵀ [d×d]
  Matrix by_p_;          // ∂v⁺/∂p [d×k]
  SparseRows turned_;    // ∂(Da s)/∂q at s = v⁺ − v [n×d]
  double given_ = 0;     // by q
  int num_parameters_ = 0;
  ParameterJacobian by_parameter_;
};

}  // namespace contact_flow
