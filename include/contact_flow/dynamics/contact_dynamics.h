// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The dynamics in a contact mode, (1a) of the paper, with the contact force, and their
/// derivatives:
///   [ M  −A_Jᵀ ] [ v̇  ]   [ f + c v ]
///   [ A_J   0  ] [ λ_J ] = [ −Ȧ_J v  ],       A = Da(q),
/// where the rows of the bilateral constraints belong to every A_J, and those of compliant ones to
/// none. With friction, (F3): the rows T_i of sticking contacts belong to A_J, too, and the column of
/// a slipping one is W_i = N_iᵀ − μ T_iᵀ d_i in place of N_iᵀ, with the direction d_i of its letter,
/// or of its slip in space:
///   [ M   −W_J ] [ v̇  ]   [ f + c v ]
///   [ A_J   0  ] [ λ_J ] = [ −Ȧ_J v  ],       λ_t,i = −μ λ_n,i d_i,
/// whose Delassus matrix A_J M⁻¹ W_J is not symmetric. Holds all scratch: calls do not allocate after the first in each mode. One object per
/// thread; the results are valid until the next call. A singular M or A_J M⁻¹ A_Jᵀ gives NaN
/// (Assumption 3 fails).
class ContactDynamics {
 public:
  ContactDynamics(const MechanicalSystem& system, const VectorRef& u,
                  const Variables& variables = {});

  const MechanicalSystem& system() const { return system_; }
  const Vector& u() const { return u_; }
  /// From now on with another input.
  void SetInput(const VectorRef& u) { u_ = u; }
  const Variables& variables() const { return variables_; }
  /// k, the number of inputs and parameters that are differentiated by.
  int num_variables() const { return k_; }

  /// Solves (1a) at x = (q, v) [nq+d] in mode J.
  void Evaluate(const VectorRef& x, ContactMode mode);
  const Vector& acceleration() const { return acceleration_; }  ///< v̇ [d]
  const Vector& force() const { return force_; }                ///< λ [n+l+r], zero off J

  /// F_J(x) as a tangent, (v, v̇) and zeros for the variables [2d+k].
  Vector Field(const VectorRef& x, ContactMode mode);

  /// Evaluates, then differentiates by the implicit function theorem: the residual's derivative at
  /// fixed (v̇, λ) and one back-substitution. Columns are (δq, δv) and the variables (δu, δp).
  void Differentiate(const VectorRef& x, ContactMode mode);
  const Matrix& acceleration_jacobian() const {
    return acceleration_jacobian_;
  }                                                                 ///< D v̇ [d × 2d+k]
  const Matrix& force_jacobian() const { return force_jacobian_; }  ///< D λ [n+l+r × 2d+k]

  /// dλ/dt [n] along F_J, for the members of J; differentiates.
  Vector ForceRate(const VectorRef& x, ContactMode mode);
  /// dλ_i/dt alone.
  double ForceRate(const VectorRef& x, ContactMode mode, int i);

  /// G_ii = Da_i M⁻¹ Da_iᵀ [1/kg] of the rigid members J and the bilateral constraints where they
  /// were last evaluated; `gain` [n+l] stays as it is elsewhere.
  void InverseMasses(Vector* gain) const {
    for (std::size_t k = 0; k < active_.size(); ++k) {
      (*gain)(active_[k]) = reach_.col(static_cast<Eigen::Index>(k)).squaredNorm();
    }
  }

  /// Calls of Evaluate so far.
  long evaluations() const { return evaluations_; }

 private:
  /// A contact that slips with friction.
  struct Sliding {
    int constraint, column;  // its place in active_
    double coefficient;      // μ
    Friction friction;
    Eigen::Vector2d direction = Eigen::Vector2d::Zero();
    double speed = 0;  // |T v| in space, where the direction turns with it; 0 in the plane
  };
  void SetMode(ContactMode mode);
  /// Where contacts slip: d, W, and the factor of A M⁻¹ W.
  void FactorizeSliding(const VectorRef& x);
  /// λ_t of the contacts that slip, and its derivative.
  void AddSlidingForce();
  void DifferentiateSlidingForce();
  /// ∂r₁ by what turns d, and by μ.
  void DifferentiateDirections(const VectorRef& x);
  /// M = L Lᵀ, W = L⁻¹ A_Jᵀ and the factor of Λ_J⁻¹ = WᵀW.
  void Factorize(const VectorRef& x);
  /// P_J and Λ_J A_J M⁻¹, from the factors: all that derivatives need.
  void Invert();
  /// v̇ = P_J (f + c v) and λ_J, where these do not change.
  void Multiply();
  /// λ_J = −Λ_J (Wᵀ y + Ȧ_J v) and v̇ = L⁻ᵀ (y + W λ_J), y = L⁻¹ (f + c v).
  void Solve();
  void DifferentiateByVariables(const VectorRef& x);

  const MechanicalSystem& system_;
  Vector u_;
  const Variables variables_;
  const int d_;
  const int nq_;
  const int n_;  // all rows
  const int k_;
  const bool constant_;  // M and Da constant: the factorization depends on the mode alone

  bool factorized_ = false;
  bool regular_ = true;  // the last factorization
  ContactMode mode_;
  /// Rows: the rigid members of mode_, the bilateral constraints, T of what sticks.
  std::vector<int> active_;
  std::vector<Sliding> sliding_;
  bool turning_ = false;  // a direction of slip depends on the state
  Matrix mass_;
  Eigen::LLT<Matrix> mass_factor_;
  Eigen::LLT<Matrix> delassus_factor_;
  Matrix active_jacobian_;   // A_J [k×d]
  Matrix reach_;             // W = L⁻¹A_Jᵀ [d×k]
  Matrix inverse_;           // P_J = M⁻¹ − M⁻¹A_JᵀΛ_J A_J M⁻¹ [d×d]
  Matrix momentum_map_;      // A_J M⁻¹ [k×d]
  Matrix force_map_;         // Λ_J A_J M⁻¹ [k×d]
  Matrix delassus_inverse_;  // Λ_J [k×k]
  Matrix push_;              // L⁻¹ W_J [d×k]; where nothing slips it is reach_, and unused
  Eigen::PartialPivLU<Matrix> sliding_factor_;  // of A_J M⁻¹ W_J
  Matrix response_;          // M⁻¹ W_J (A_J M⁻¹ W_J)⁻¹ [d×k], likewise force_map_ᵀ
  std::vector<Matrix> direction_jacobian_;  // ∂d by (q, v) of each sliding contact in space [2 × 2d]
  Vector bias_;              // Ȧ_J v [k]
  Vector multiplier_;        // λ_J [k]
  ConstraintTerms terms_;
  ResidualJacobian residual_;
  ParameterJacobian parameter_residual_;

  Vector applied_;  // f + c v
  Vector acceleration_;
  Vector force_;
  Matrix acceleration_jacobian_;
  Matrix force_jacobian_;
  Matrix variable_momentum_;      // ∂r₁ by the variables [d×k]
  Matrix active_residual_;        // ∂r₂ of the members [· × 2d+k]
  Matrix active_force_jacobian_;  // [· × 2d+k]
  long evaluations_ = 0;
};

/// G = Da_C P Da_Cᵀ [k×k] (InverseInertia) and the normal accelerations without contact [k], over
/// the k members of C in increasing order.
void Delassus(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u, ContactMode C,
              Matrix* G, Vector* b);

}  // namespace contact_flow
