// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <list>
#include <memory>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/mass_factor.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

class RowSolver;

/// The dynamics in a contact mode, (1a) of the paper, with the contact force, and
/// their derivatives:
///   [ M  −A_Jᵀ ] [ v̇  ]   [ f + c v ]
///   [ A_J   0  ] [ λ_J ] = [ −Ȧ_J v  ],       A = Da(q),
/// where the rows of the bilateral constraints belong to every A_J, and those of compliant ones to
/// none. With friction, (F3): the rows T_i of sticking contacts belong to A_J, too, and the column
/// of a slipping one is W_i = N_iᵀ − μ T_iᵀ d_i in place of N_iᵀ, with the direction d_i of its
/// letter, or of its slip in space:
///   [ M   −W_J ] [ v̇  ]   [ f + c v ]
///   [ A_J   0  ] [ λ_J ] = [ −Ȧ_J v  ],       λ_t,i = −μ λ_n,i d_i,
/// whose Delassus matrix A_J M⁻¹ W_J is not symmetric. Where rows of A_J depend on others (two
/// corners of one body that stick) v̇ is unique, and forces are not: λ is then the admissible one,
/// inside its cones, with the smallest sum of squares [N²], or the smallest of all where none is
/// admissible; and shared_margin() tells how far from that. Where v̇ depends on how forces are
/// shared (such a face slides and turns) they are those of equal springs, infinitely stiff, in
/// their cones: Zᵀ λ = 0 for all Z with A_Jᵀ Z = 0 inside all; there is no derivative, and where no
/// such λ exists NaN. Holds all scratch, and the factors of the last few modes: calls do not
/// allocate after the first in each of these. One object per thread; results are valid until the
/// next call. A singular M, or A_J M⁻¹ A_Jᵀ without friction, gives NaN (Assumption 3 fails).
class ContactDynamics {
 public:
  ContactDynamics(const MechanicalSystem& system, const VectorRef& u,
                  const Variables& variables = {});
  ~ContactDynamics();
  ContactDynamics(const ContactDynamics&) = delete;
  ContactDynamics& operator=(const ContactDynamics&) = delete;

  const MechanicalSystem& system() const { return system_; }
  const Vector& u() const { return u_; }
  /// From now on with another input.
  void SetInput(const VectorRef& u) { u_ = u; }
  const Variables& variables() const { return variables_; }
  /// k, the number of inputs and parameters that are differentiated by.
  int num_variables() const { return k_; }

  /// Solves (1a) at x = (q, v) [nq+d] in mode J.
  void Evaluate(const VectorRef& x, const ContactMode& mode);
  const Vector& acceleration() const { return acceleration_; }  ///< v̇ [d]
  const Vector& force() const { return force_; }                ///< λ [n+l+r], zero off J

  /// Contacts whose forces are not unique, with friction.
  ConstraintSet shared() const { return at_ == nullptr ? ConstraintSet() : at_->shared; }
  /// … and whose shares decide the motion, those of equal springs.
  ConstraintSet springs() const { return at_ == nullptr ? ConstraintSet() : at_->springs; }
  /// max over all λ with these accelerations of min over the shared contacts of μ λ_n − |λ_t|, or
  /// of λ_n where nothing limits it or it slips [N]: positive as long as an admissible λ exists.
  double shared_margin() const {
    FindShare();
    return shared_margin_;
  }
  /// Its gradient by λ [n+l+r], the same for all these λ.
  const Vector& shared_gradient() const {
    FindShare();
    return shared_gradient_;
  }
  /// The least of these of the smallest λ, which is at hand; no more than shared_margin().
  double shared_slack() const { return shared_slack_; }

  /// F_J(x) as a tangent, (v, v̇) and zeros for the variables [2d+k].
  Vector Field(const VectorRef& x, const ContactMode& mode);

  /// Evaluates, then differentiates by the implicit function theorem: the residual's derivative at
  /// fixed (v̇, λ) and one back-substitution. Columns are (δq, δv) and the variables (δu, δp).
  void Differentiate(const VectorRef& x, const ContactMode& mode);
  const Matrix& acceleration_jacobian() const {
    return acceleration_jacobian_;
  }                                                                 ///< D v̇ [d × 2d+k]
  const Matrix& force_jacobian() const { return force_jacobian_; }  ///< D λ [n+l+r × 2d+k]

  /// dλ/dt [n] along F_J, for the members of J; differentiates.
  Vector ForceRate(const VectorRef& x, const ContactMode& mode);
  /// dλ_i/dt alone.
  double ForceRate(const VectorRef& x, const ContactMode& mode, int i);

  /// The same of all rows, dλ/dt [n+l+r], without the Jacobians where these cost more: valid until
  /// the next call.
  const Vector& ForceRates(const VectorRef& x, const ContactMode& mode);

  /// Where M has many zeros, and there are contacts without friction alone: evaluates the mode of
  /// `contacts` and `pressed`, and says whether all contacts are independent and push by far more
  /// than what could vanish at the instant. Then SelectMode chooses them all. Else false.
  bool PushClearly(const VectorRef& x, const ConstraintSet& contacts, const ConstraintSet& pressed);

  /// G_ii = Da_i M⁻¹ Da_iᵀ [1/kg] of the rigid members J and the bilateral constraints where they
  /// were last evaluated; `gain` [n+l] stays as it is elsewhere.
  void InverseMasses(Vector* gain) const {
    for (std::size_t k = 0; k < at_->active.size(); ++k) {
      (*gain)(at_->active[k]) = at_->reach.col(static_cast<Eigen::Index>(k)).squaredNorm();
    }
  }

  /// det(A_J M⁻¹ W_J), over the product of the diagonal of A_J M⁻¹ A_Jᵀ, where it was last
  /// evaluated; for one contact 1 − μ G_nt/G_nn, the slip forward. +∞ without slip. Where it passes
  /// zero along a motion that slips, that is no longer the only one, or ends (Painlevé).
  double slip_regularity() const;

  /// Calls of Evaluate so far.
  long evaluations() const { return evaluations_; }

 private:
  /// A contact that slips with friction.
  struct Sliding {
    int constraint, column;  // its place in `active`
    Friction friction;
    Eigen::Vector2d direction = Eigen::Vector2d::Zero();
    double speed = 0;           // |T v| in space, where the direction turns with it
    Matrix direction_jacobian;  // ∂d in space [2 × 2d+k]
  };
  /// The factors of a mode, and scratch of its size k, the number of its rows.
  struct ModeFactors {
    ContactMode mode;
    bool known = false;   // the factors, for good: where they depend on the mode alone
    bool regular = true;  // they exist
    bool poor = false;    // solutions by them lose digits, and are refined
    /// Rows: the rigid members of the mode, the bilateral constraints, T of what sticks.
    std::vector<int> active;
    Matrix jacobian;          // A_J [k×d]
    Matrix reach;             // W = L⁻¹A_Jᵀ [d×k]
    Matrix inverse;           // P_J = M⁻¹ − M⁻¹A_JᵀΛ_J A_J M⁻¹ [d×d]
    Matrix momentum_map;      // A_J M⁻¹ [k×d]
    Matrix force_map;         // Λ_J A_J M⁻¹ [k×d]
    Matrix delassus_inverse;  // Λ_J [k×k]
    Eigen::LLT<Matrix> delassus_factor;
    std::vector<Sliding> sliding;
    bool turning = false;                        // a direction of slip depends on the state
    Matrix push;                                 // L⁻¹W_J [d×k], where something slips
    Eigen::PartialPivLU<Matrix> sliding_factor;  // of A_J M⁻¹ W_J
    Matrix response;    // M⁻¹ W_J (A_J M⁻¹ W_J)⁻¹ [d×k]; force_mapᵀ where nothing slips
    Vector bias;        // Ȧ_J v [k]
    Vector multiplier;  // λ_J [k]
    // Where rows are dependent:
    bool dependent = false;
    ConstraintSet shared;
    Matrix freedom;         // Z [k×f]: λ_J + Z ν are the forces with the same accelerations
    Matrix generalized;     // an inverse of A_J M⁻¹ W_J [k×k], by which λ_J is the smallest
    Matrix residual;        // ∂r₂ of the members [k × 2d+·]
    Matrix force_jacobian;  // [k × 2d+·]
    ConstraintSet springs;  // of those where rows are dependent
  };
  /// Those of this mode become the present ones, at_: derivatives go to and fro
  /// between a few modes.
  void SetMode(const ContactMode& mode);
  /// The tangential rows and slips of the present mode.
  void AddFriction();
  /// Where contacts slip: d, W, and the factor of A M⁻¹ W.
  void FactorizeSliding(const VectorRef& x);
  /// Finds rows of A_J that depend on others, where pivots say that there are any; false where
  /// there are none.
  bool FindDependence();
  bool FindSlidingDependence();
  void NoteShared();
  /// Chooses λ_J among those that are not unique.
  void ShareForces();
  /// The share with the margin, once for each evaluation.
  void FindShare() const;
  /// λ_J by row of the system.
  void SpreadForces(const Vector& multiplier, Vector* force) const;
  /// λ_t of the contacts that slip, and its derivative.
  void AddSlidingForce();
  void DifferentiateSlidingForce();
  /// ∂r₁ by what turns d, and by μ.
  void DifferentiateDirections(const VectorRef& x);
  /// M = L Lᵀ, W = L⁻¹ A_Jᵀ and the factor of Λ_J⁻¹ = WᵀW.
  void Factorize(const VectorRef& x);
  /// P_J and Λ_J A_J M⁻¹, from the factors: all that derivatives need.
  void Invert();
  /// Their contacts' part, where M has many zeros.
  void InvertSparse();
  /// Whether pivots of Λ_J⁻¹ say that its solutions lose digits; and what gives them back.
  bool IsPoor() const;
  void RefineSolution();
  void RefineInverse();
  /// v̇ = P_J (f + c v) and λ_J, where these do not change.
  void Multiply();
  /// λ_J = −Λ_J (Wᵀ y + Ȧ_J v) and v̇ = L⁻ᵀ (y + W λ_J), y = L⁻¹ (f + c v).
  void Solve();
  void DifferentiateEvaluated(const VectorRef& x);
  void DifferentiateByVariables(const VectorRef& x);

  const MechanicalSystem& system_;
  Vector u_;
  const Variables variables_;
  const int d_;
  const int nq_;
  const int n_;  // all rows
  const int k_;
  const bool constant_;  // M and Da constant: the factorization depends on the mode alone

  static constexpr std::size_t kMaxKeptModes = 8;

  bool has_mass_ = false;         // mass_ and its factor, for good
  std::list<ModeFactors> modes_;  // the latest first
  ModeFactors* at_ = nullptr;     // the latest
  Matrix mass_;
  MassFactor mass_factor_;
  ConstraintTerms terms_;
  ResidualJacobian residual_;
  ParameterJacobian parameter_residual_;

  Vector applied_;  // f + c v
  Vector acceleration_;
  Vector force_;
  double shared_slack_ = 0;
  mutable bool share_known_ = false;
  mutable double shared_margin_ = 0;
  mutable Vector shared_gradient_;
  mutable Vector interior_;  // the share where the margin is
  Matrix acceleration_jacobian_;
  Matrix force_jacobian_;
  Matrix variable_momentum_;    // ∂r₁ by the variables [d×k]
  Matrix variable_constraint_;  // ∂r₂ by them [n+l+r × k], of active rows
  std::unique_ptr<RowSolver> row_solver_;
  Vector force_rate_;  // dλ/dt [n+l+r], and scratch for it
  Vector momentum_rate_, multiplier_rate_;
  Vector column_;
  long evaluations_ = 0;
};

/// G = Da_C P Da_Cᵀ [k×k] (InverseInertia) and the normal accelerations without contact [k], over
/// the k members of C in increasing order.
void Delassus(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u,
              const ConstraintSet& C, Matrix* G, Vector* b);

}  // namespace contact_flow
