// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/model/configuration_space.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A named number of a model that a user may set.
struct Parameter {
  std::string name;     ///< as in YAML
  std::string unit;     ///< SI unit, "" for a pure number.
  std::string meaning;  ///< one phrase
  double value = 0;     ///< in force
};

/// What a person calls the parts of a system; every array that crosses the public border has
/// the length and the order of one of these lists.
struct SystemDescription {
  std::string name;                      ///< of the model
  std::string summary;                   ///< one sentence
  std::vector<std::string> coordinates;  ///< [nq] numbers of a configuration
  std::vector<std::string> units;        ///< [nq] their units: "m" or "rad" (or "s", or "")
  /// [d] velocities and tangents; the same as `coordinates` but where a quaternion has four numbers
  /// and its angular velocity three.
  std::vector<std::string> velocities;
  std::vector<std::string> constraints;  ///< [n] unilateral
  std::vector<std::string> bilateral;    ///< [l]
  std::vector<std::string> inputs;       ///< [m]
  std::vector<Parameter> parameters;     ///< with units and values
};

/// The run a user gets who asks for nothing in particular.
struct NominalRun {
  Vector x;             ///< initial state (q, v) [nq+d]
  Vector u;             ///< constant input [m]
  double duration = 1;  ///< [s]
};

/// Coulomb friction of one contact, (F2): |λ_t| ≤ μ λ_n, and λ_t = −μ λ_n s/|s| where it slips, at
/// s = T(q) v ≠ 0.
struct Friction {
  static constexpr double kNoSlip = std::numeric_limits<double>::infinity();  ///< it never slips
  double coefficient = 0;  ///< μ ≥ 0; kNoSlip: the contact never slips
  int row = 0;             ///< of T in ConstraintTerms, the first; 0 without friction
  int dimension = 0;       ///< rows: 1 in the plane, 2 in space, 0 without friction
};

/// The constraint functions and their time derivatives along a motion: rows of n unilateral
/// constraints, then l bilateral ones, then the r rows of the tangential maps T(q), which are data
/// of the model and no gradients.
struct ConstraintTerms {
  Vector gap;       ///< a(q), then b(q), then zeros [n+l+r], [m] or [rad]
  Matrix jacobian;  ///< Da(q), then Db(q), then T(q) [n+l+r × d]
  Vector bias;      ///< (d/dt Da) v, then of Db and of T [n+l+r]
};

/// First derivatives of a residual, unknowns held fixed. For the dynamics (1a) the residual is
///   r₁ = M q̈ − f − c v − Daᵀ λ  [d],      r₂ = Da q̈ + (d/dt Da) v  [n+l+r],
/// Da standing for all rows, and λ for the forces along all of them. By q means by left-trivialized
/// tangents (ConfigurationSpace).
struct ResidualJacobian {
  Matrix momentum_q;    ///< ∂r₁/∂q [d×d]
  Matrix momentum_v;    ///< ∂r₁/∂v [d×d]
  Matrix momentum_u;    ///< ∂r₁/∂u [d×m]
  Matrix constraint_q;  ///< ∂r₂/∂q [n+l+r × d]
  Matrix constraint_v;  ///< ∂r₂/∂v [n+l+r × d]
};

/// The same by k named parameters.
struct ParameterJacobian {
  Matrix momentum;     ///< ∂r₁/∂p [d×k]
  Matrix constraint;   ///< ∂r₂/∂p [n+l+r × k]
  Matrix gap;          ///< ∂(a, b, 0)/∂p [n+l+r × k]
  Matrix restitution;  ///< ∂γ/∂p [n×k]
};

/// A mechanical system subject to unilateral constraints: the paper's tuple (M, f, a, γ), Sec. 2,
/// with what Sec. 6.1 adds to it: bilateral constraints b(q) = 0, configuration spaces other than
/// ℝᵈ and efforts that depend on the contact mode.
///
///   (1a)  M(q) v̇ = f(q, v, u, J) + c(q, v) v + Da_J(q)ᵀ λ_J + Db(q)ᵀ μ,    a(q) ≥ 0,  b(q) = 0
///   (1b)  v⁺ = Δ_J(q) v⁻,  restitution γ
///
/// The Coriolis term follows from M: c(q, v) v = ½ ∂_q(vᵀ M(q) v) − Ṁ v (and − ω × ∂_ω(½ vᵀ M v)
/// for the angular velocities of rotations). With friction, Σ T_iᵀ λ_t,i joins the right-hand side
/// (Friction). Arrays over constraints have the n unilateral ones first; a force λ or impulse p of
/// length n+l+r holds those of the bilateral constraints and of the tangential rows behind. A
/// system is constant and may be shared between threads. Outputs are resized on first use only, so
/// that calls with the same output do not allocate.
class MechanicalSystem {
 public:
  virtual ~MechanicalSystem() = default;

  /// Its names and units.
  const SystemDescription& description() const { return description_; }
  /// The run of who asks for nothing in particular.
  const NominalRun& nominal() const { return nominal_; }
  /// What q is.
  const ConfigurationSpace& space() const { return space_; }
  /// d, the number of velocities.
  int dof() const { return space_.dof(); }
  /// nq ≥ d, the numbers of a configuration.
  int num_positions() const { return space_.num_positions(); }
  /// nq + d.
  int state_size() const { return num_positions() + dof(); }
  /// n, the number of unilateral constraints.
  int num_constraints() const { return static_cast<int>(description_.constraints.size()); }
  /// l, the number of bilateral constraints.
  int num_bilateral() const { return static_cast<int>(description_.bilateral.size()); }
  /// m, the number of inputs.
  int num_inputs() const { return static_cast<int>(description_.inputs.size()); }
  /// r, the rows of all tangential maps.
  int num_tangential() const { return num_tangential_; }
  /// n + l + r, the length of forces and impulses.
  int num_rows() const { return num_constraints() + num_bilateral() + num_tangential_; }
  /// Of each contact [n]; empty where none has friction.
  const std::vector<Friction>& friction() const { return friction_; }
  /// Whether any contact has friction.
  bool HasFriction() const { return num_tangential_ > 0; }
  /// γ [n], each in [0, 1] for passive contacts; 0 is plastic.
  const Vector& restitution() const { return restitution_; }
  /// The constraints that are not rigid but switches: a_i < 0 is allowed, i ∈ J means a_i < 0, and
  /// all that happens at a_i = 0 is that the effort f(q, v, u, J) changes (Sec. 6.1).
  ConstraintSet compliant() const { return compliant_; }
  /// True when f depends on J.
  bool HasContactEffort() const { return contact_effort_; }

  /// (q ⊞ w_q, v + w_v), for a tangent w [2d].
  Vector Perturb(const VectorRef& x, const VectorRef& w) const;
  /// The tangent w [2d] with Perturb(from, w) = to.
  Vector Separation(const VectorRef& to, const VectorRef& from) const;

  /// True when M does not depend on q: callers may keep its factorization.
  virtual bool HasConstantMass() const { return false; }
  /// True when every a_i and b_i is affine: Da does not depend on q.
  virtual bool HasAffineConstraints() const { return false; }

  /// M(q) [d×d] (skipped when `mass` is null) and h = f(q, v, u, J) + c(q, v) v [d].
  virtual void Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                        const ContactMode& mode, Matrix* mass, Vector* force) const = 0;
  /// a, Da and (d/dt Da) v; the same of b and of T behind them.
  virtual void Constraints(const VectorRef& q, const VectorRef& v,
                           ConstraintTerms* terms) const = 0;
  /// The same where the rows of these contacts, of their slips and of all b are asked for: others
  /// may be left as they are. A robot of many contacts has few that are closed.
  virtual void ConstraintsOf(const ConstraintSet& /*asked*/, const VectorRef& q, const VectorRef& v,
                             ConstraintTerms* terms) const {
    Constraints(q, v, terms);
  }
  /// Derivatives of r₁, r₂ above at fixed acceleration v̇ [d] and force λ [n+l+r],
  /// zero off the mode.
  virtual void DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                                     const ContactMode& mode, const VectorRef& acceleration,
                                     const VectorRef& force, ResidualJacobian* jacobian) const = 0;
  /// The same where of r₂ the rows of the mode's contacts, of their slips and of all b are asked
  /// for: others may be left out.
  virtual void DifferentiateDynamicsOfMode(const VectorRef& q, const VectorRef& v,
                                           const VectorRef& u, const ContactMode& mode,
                                           const VectorRef& acceleration, const VectorRef& force,
                                           ResidualJacobian* jacobian) const {
    DifferentiateDynamics(q, v, u, mode, acceleration, force, jacobian);
  }
  /// Derivatives with respect to q of the impact residual of (1b),
  ///   r₁ = M(q) Δv − Da(q)ᵀ p [d],      r₂ = Da(q) s [n+l],
  /// at fixed jump Δv = v⁺ − v⁻ [d], impulse p [n+l+r] and s [d]; fills momentum_q
  /// and constraint_q.
  virtual void DifferentiateImpact(const VectorRef& q, const VectorRef& jump,
                                   const VectorRef& impulse, const VectorRef& s,
                                   ResidualJacobian* jacobian) const = 0;
  /// Derivatives of r₁, r₂ of the dynamics by the parameters with these indices into
  /// description().parameters; fills momentum and constraint.
  virtual void DifferentiateDynamicsByParameters(const VectorRef& q, const VectorRef& v,
                                                 const VectorRef& u, const ContactMode& mode,
                                                 const VectorRef& acceleration,
                                                 const VectorRef& force,
                                                 const std::vector<int>& parameters,
                                                 ParameterJacobian* jacobian) const = 0;
  /// Derivatives of r₁, r₂ of the impact, of the gaps and of the restitution by
  /// parameters; fills all.
  virtual void DifferentiateImpactByParameters(const VectorRef& q, const VectorRef& jump,
                                               const VectorRef& impulse, const VectorRef& s,
                                               const std::vector<int>& parameters,
                                               ParameterJacobian* jacobian) const = 0;

  /// ∂μ/∂p of the contacts with friction and finite μ [n×k].
  virtual Matrix DifferentiateFriction(const std::vector<int>& parameters) const {
    return Matrix::Zero(num_constraints(), static_cast<Eigen::Index>(parameters.size()));
  }

 protected:
  SystemDescription description_;   ///< set by the derived class
  NominalRun nominal_;              ///< set by the derived class
  ConfigurationSpace space_;        ///< set by the derived class
  Vector restitution_;              ///< γ [n], set by the derived class
  ConstraintSet compliant_;         ///< set by the derived class
  bool contact_effort_ = false;     ///< set by the derived class
  std::vector<Friction> friction_;  ///< of each contact, set by the derived class; or empty
  int num_tangential_ = 0;          ///< r, set by the derived class
};

/// What besides the initial state an outcome is differentiated by. Tangents are then
/// w = (δq, δv, δu, δp) [2d+k].
struct Variables {
  bool inputs = false;          ///< all inputs u
  std::vector<int> parameters;  ///< indices into SystemDescription::parameters

  /// k.
  int Size(const MechanicalSystem& system) const {
    return (inputs ? system.num_inputs() : 0) + static_cast<int>(parameters.size());
  }
};

/// Indices of named parameters; throws std::invalid_argument, with the nearest name,
/// for an unknown one.
std::vector<int> ParameterIndices(const SystemDescription& description,
                                  const std::vector<std::string>& names);

}  // namespace contact_flow
