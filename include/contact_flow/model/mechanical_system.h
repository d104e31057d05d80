// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A named number of a model that a user may set.
struct Parameter {
  std::string name;
  std::string unit;     ///< SI unit, "" for a pure number.
  std::string meaning;  ///< one phrase
  double value = 0;
};

/// What a person calls the parts of a system; every array that crosses the public border has
/// the length and the order of one of these lists.
struct SystemDescription {
  std::string name;
  std::string summary;                   ///< one sentence
  std::vector<std::string> coordinates;  ///< [d]
  std::vector<std::string> units;        ///< [d] unit of each coordinate: "m" or "rad" (or "s")
  std::vector<std::string> constraints;  ///< [n]
  std::vector<std::string> inputs;       ///< [m]
  std::vector<Parameter> parameters;
};

/// The run a user gets who asks for nothing in particular.
struct NominalRun {
  Vector x;             ///< initial state (q, v) [2d]
  Vector u;             ///< constant input [m]
  double duration = 1;  ///< [s]
};

/// a(q) and its time derivatives along a motion, for all n constraints.
struct ConstraintTerms {
  Vector gap;       ///< a(q) [n], [m] or [rad]
  Matrix jacobian;  ///< Da(q) [n×d]
  Vector bias;      ///< (d/dt Da) v = D²a(q)(v, v) [n]
};

/// First derivatives of a residual, unknowns held fixed. For the dynamics (1a) the residual is
///   r₁ = M q̈ − f − c v − Daᵀ λ  [d],      r₂ = Da q̈ + (d/dt Da) v  [n].
struct ResidualJacobian {
  Matrix momentum_q;    ///< ∂r₁/∂q [d×d]
  Matrix momentum_v;    ///< ∂r₁/∂v [d×d]
  Matrix momentum_u;    ///< ∂r₁/∂u [d×m]
  Matrix constraint_q;  ///< ∂r₂/∂q [n×d]
  Matrix constraint_v;  ///< ∂r₂/∂v [n×d]
};

/// A mechanical system subject to unilateral constraints: the paper's tuple (M, f, a, γ), Sec. 2.
///
///   (1a)  M(q) q̈ = f(q, v, u) + c(q, v) v + Da_J(q)ᵀ λ_J,      a(q) ≥ 0
///   (1b)  v⁺ = Δ_J(q) v⁻,  restitution γ
///
/// The Coriolis term follows from M: c(q, v) v = ½ ∂_q(vᵀ M(q) v) − Ṁ v.
/// A system is constant and may be shared between threads. Outputs are resized on first use only,
/// so that calls with the same output do not allocate.
class MechanicalSystem {
 public:
  virtual ~MechanicalSystem() = default;

  const SystemDescription& description() const { return description_; }
  const NominalRun& nominal() const { return nominal_; }
  int dof() const { return static_cast<int>(description_.coordinates.size()); }
  int num_constraints() const { return static_cast<int>(description_.constraints.size()); }
  int num_inputs() const { return static_cast<int>(description_.inputs.size()); }
  /// γ [n], each in [0, 1] for passive contacts; 0 is plastic.
  const Vector& restitution() const { return restitution_; }

  /// True when M does not depend on q: callers may keep its factorization.
  virtual bool HasConstantMass() const { return false; }
  /// True when every a_i is affine: Da does not depend on q.
  virtual bool HasAffineConstraints() const { return false; }

  /// M(q) [d×d] (skipped when `mass` is null) and h = f(q, v, u) + c(q, v) v [d].
  virtual void Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u, Matrix* mass,
                        Vector* force) const = 0;
  /// a, Da and (d/dt Da) v.
  virtual void Constraints(const VectorRef& q, const VectorRef& v, ConstraintTerms* terms) const = 0;
  /// Derivatives of r₁, r₂ above at fixed acceleration q̈ [d] and force λ [n] (zero off the mode).
  virtual void DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                                     const VectorRef& acceleration, const VectorRef& force,
                                     ResidualJacobian* jacobian) const = 0;
  /// Derivatives with respect to q of the impact residual of (1b),
  ///   r₁ = M(q) Δv − Da(q)ᵀ p [d],      r₂ = Da(q) s [n],
  /// at fixed jump Δv = v⁺ − v⁻ [d], impulse p [n] and s [d]; fills momentum_q and constraint_q.
  virtual void DifferentiateImpact(const VectorRef& q, const VectorRef& jump,
                                   const VectorRef& impulse, const VectorRef& s,
                                   ResidualJacobian* jacobian) const = 0;

 protected:
  SystemDescription description_;
  NominalRun nominal_;
  Vector restitution_;
};

}  // namespace contact_flow
