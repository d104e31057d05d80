// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The dynamics in a contact mode, (1a) of the paper, with the contact force, and their derivatives:
///   [ M  −A_Jᵀ ] [ q̈  ]   [ f + c v ]
///   [ A_J   0  ] [ λ_J ] = [ −Ȧ_J v  ],       A = Da(q).
/// Holds all scratch: calls do not allocate after the first in each mode. One object per thread; the
/// results are valid until the next call. A singular M or A_J M⁻¹ A_Jᵀ gives NaN (Assumption 3 fails).
class ContactDynamics {
 public:
  ContactDynamics(const MechanicalSystem& system, const VectorRef& u);

  const MechanicalSystem& system() const { return system_; }
  const Vector& u() const { return u_; }

  /// Solves (1a) at x = (q, v) [2d] in mode J.
  void Evaluate(const VectorRef& x, ContactMode mode);
  const Vector& acceleration() const { return acceleration_; }  ///< q̈ [d]
  const Vector& force() const { return force_; }                ///< λ [n], zero off J

  /// ẋ = F_J(x) = (v, q̈) [2d].
  Vector Field(const VectorRef& x, ContactMode mode);

  /// Evaluates, then differentiates by the implicit function theorem: the residual's derivative at fixed
  /// (q̈, λ) and one back-substitution.
  void Differentiate(const VectorRef& x, ContactMode mode);
  const Matrix& acceleration_jacobian() const { return acceleration_jacobian_; }  ///< D_x q̈ [d×2d]
  const Matrix& force_jacobian() const { return force_jacobian_; }                ///< D_x λ [n×2d]

  /// dλ/dt [n] along F_J, for the members of J; differentiates.
  Vector ForceRate(const VectorRef& x, ContactMode mode);
  /// dλ_i/dt alone.
  double ForceRate(const VectorRef& x, ContactMode mode, int i);

  /// Calls of Evaluate so far.
  long evaluations() const { return evaluations_; }

 private:
  void Factorize(const VectorRef& x, ContactMode mode);

  const MechanicalSystem& system_;
  const Vector u_;
  const int d_;
  const int n_;
  const bool constant_;  // M and Da constant: the factorization depends on the mode alone

  bool factorized_ = false;
  ContactMode mode_;
  std::vector<int> active_;  // the members of mode_
  Matrix mass_;
  Eigen::LLT<Matrix> mass_factor_;
  Eigen::LLT<Matrix> delassus_factor_;
  Matrix active_jacobian_;  // A_J [k×d]
  Matrix inverse_;          // P_J = M⁻¹ − M⁻¹A_JᵀΛ_J A_J M⁻¹ [d×d]
  Matrix force_map_;        // Λ_J A_J M⁻¹ [k×d]
  Matrix delassus_inverse_; // Λ_J [k×k]
  Vector bias_;             // Ȧ_J v [k]
  ConstraintTerms terms_;
  ResidualJacobian residual_;

  Vector applied_;  // f + c v
  Vector acceleration_;
  Vector force_;
  Matrix acceleration_jacobian_;
  Matrix force_jacobian_;
  Matrix active_residual_;        // ∂r₂ of the members [k×2d]
  Matrix active_force_jacobian_;  // [k×2d]
  long evaluations_ = 0;
};

/// G = Da_C M⁻¹ Da_Cᵀ [k×k] and the free normal accelerations b = Da_C M⁻¹ (f + c v) + Ḋa_C v [k], over the
/// k members of C in increasing order.
void Delassus(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u, ContactMode C,
              Matrix* G, Vector* b);

/// The contact mode of a state among the candidates C = {i : a_i = 0, Da_i v = 0} (Sec. 2): the support of
///   0 ≤ λ ⟂ ä = Da q̈ + Ḋa v ≥ 0.
/// A constraint whose force vanishes there, or does so within `time_tolerance` [s] at its present rate,
/// belongs to the mode exactly when its force would grow: dλ_i/dt > 0 in the mode with it.
ContactMode SelectContactMode(ContactDynamics* dynamics, const VectorRef& x, ContactMode candidates,
                              double time_tolerance);

}  // namespace contact_flow
