// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/mechanical_system.h"
#include "test/adversary/random_system.h"

namespace contact_flow {
namespace adversary {

/// Other units, and another order of coordinates and constraints: a motion q(t) is
/// q'_{place(i)}(t') = length_i q_i(t'/time).
struct Units {
  Vector length;    ///< of each coordinate [d]
  Vector gap;       ///< of each constraint, and of the slip there [n]
  double mass = 1;  ///< of the coordinates with length 1
  double time = 1;
  std::vector<int> coordinate;  ///< place of each coordinate [d]
  std::vector<int> constraint;  ///< place of each constraint [n]

  static Units Same(int d, int n);
  /// A state in these units [2d], and back.
  Vector State(const Vector& x) const;
  Vector Back(const Vector& x) const;
  /// Tolerances for these units, for the same motion.
  SimulateOptions Scale(const SimulateOptions& options) const;
};

/// A system in other units: the same motions. M' = mass M / (length length), f' = mass f / (length
/// time²), a' = gap a, and T' = gap T, so that forces keep their cones.
class RescaledSystem : public MechanicalSystem {
 public:
  RescaledSystem(const MechanicalSystem& system, Units units);

  bool HasConstantMass() const override { return system_.HasConstantMass(); }
  bool HasAffineConstraints() const override { return system_.HasAffineConstraints(); }
  void Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u, const ContactMode& mode,
                Matrix* mass, Vector* force) const override;
  void Constraints(const VectorRef& q, const VectorRef& v, ConstraintTerms* terms) const override;
  void DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                             const ContactMode& mode, const VectorRef& acceleration,
                             const VectorRef& force, ResidualJacobian* jacobian) const override;
  void DifferentiateImpact(const VectorRef& q, const VectorRef& jump, const VectorRef& impulse,
                           const VectorRef& s, ResidualJacobian* jacobian) const override;
  void DifferentiateDynamicsByParameters(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                                         const ContactMode& mode, const VectorRef& acceleration,
                                         const VectorRef& force, const std::vector<int>& parameters,
                                         ParameterJacobian* jacobian) const override;
  void DifferentiateImpactByParameters(const VectorRef& q, const VectorRef& jump,
                                       const VectorRef& impulse, const VectorRef& s,
                                       const std::vector<int>& parameters,
                                       ParameterJacobian* jacobian) const override;
  Matrix DifferentiateFriction(const std::vector<int>& parameters) const override;

 private:
  /// A row of the old constraint functions, its new place and its unit.
  void PlaceRow(int row, int place, double unit);
  /// Rows [n×k] at the contacts' new places; pure numbers.
  Matrix Placed(const Matrix& rows) const;
  // S = ∂q'/∂q [d×d] and P = ∂(a', s')/∂(a, s) [n+r × n+r], permutations with factors.
  Vector Q(const VectorRef& q) const { return to_old_ * q; }
  Vector V(const VectorRef& v) const { return units_.time * (to_old_ * v); }
  Vector A(const VectorRef& a) const { return units_.time * units_.time * (to_old_ * a); }

  const MechanicalSystem& system_;
  const Units units_;
  Matrix to_old_;      // S⁻¹
  Matrix force_;       // mass / time² S⁻ᵀ: old forces to new ones
  Matrix gaps_;        // P
  Matrix multiplier_;  // old λ = multiplier · new λ
};

}  // namespace adversary
}  // namespace contact_flow
