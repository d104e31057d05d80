// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/model/effort_limits.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/narrow_surfaces.h"
#include "contact_flow/model/spline_knots.h"

namespace contact_flow {

/// A system whose inputs are led linearly through time, as one whose inputs are held: its effort
/// is that of the system `base` under
///   u = a + b (τ − s),    with held inputs (a, b, s) [2m+1],
/// where τ is a coordinate more, a clock with rate 1, which nothing pushes: x = (q, τ, v, 1).
/// Where u is continuous at a change of (a, b, s) the field is, too, and only its rate jumps. All
/// that holds of runs under held inputs, their events and derivatives, holds of these.
class LinearInputs : public MechanicalSystem,
                     public EffortLimits,
                     public SplineKnots,
                     public NarrowSurfaces {
 public:
  explicit LinearInputs(std::shared_ptr<const MechanicalSystem> base);

  const MechanicalSystem& base() const { return *base_; }
  /// (q, τ, v, 1) [nq+d+2] of x = (q, v) of the base.
  Vector State(const VectorRef& x, double clock) const;
  /// (q, v) [nq+d] of (q, τ, v, 1).
  Vector BaseState(const VectorRef& x) const;
  /// u at (q, τ, …) under held inputs [m].
  Vector Acting(const VectorRef& q, const VectorRef& held) const;
  /// (a, b, s) of an interval from t on, h > 0 long, at whose ends the inputs are u0 and u1 [m].
  static Vector Held(double t, double h, const VectorRef& u0, const VectorRef& u1);

  bool HasConstantMass() const override { return base_->HasConstantMass(); }
  bool HasAffineConstraints() const override { return base_->HasAffineConstraints(); }
  void Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u, const ContactMode& mode,
                Matrix* mass, Vector* force) const override;
  void Constraints(const VectorRef& q, const VectorRef& v, ConstraintTerms* terms) const override;
  void ConstraintsOf(const ConstraintSet& asked, const VectorRef& q, const VectorRef& v,
                     ConstraintTerms* terms) const override;
  void DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                             const ContactMode& mode, const VectorRef& acceleration,
                             const VectorRef& force, ResidualJacobian* jacobian) const override;
  void DifferentiateDynamicsOfMode(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                                   const ContactMode& mode, const VectorRef& acceleration,
                                   const VectorRef& force,
                                   ResidualJacobian* jacobian) const override;
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
  Matrix DifferentiateFriction(const std::vector<int>& parameters) const override {
    return base_->DifferentiateFriction(parameters);
  }

  const std::vector<std::string>& limited_efforts() const override;
  void EffortShares(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                    const ContactMode& mode, Vector* share) const override;
  double TimeToKnot(const VectorRef& q, const VectorRef& v) const override;
  const std::vector<std::vector<double>>& knots_of_places() const override;
  void Places(const VectorRef& q, const ContactMode& mode, Vector* place) const override;
  bool HasNarrowSurfaces() const override;
  void Passages(const VectorRef& q, const VectorRef& v,
                std::vector<SurfacePassage>* passages) const override;

 private:
  /// What the clock adds to derivatives of the base's dynamics.
  void AddClock(const VectorRef& q, const VectorRef& u, ResidualJacobian* jacobian) const;

  std::shared_ptr<const MechanicalSystem> base_;
  const EffortLimits* limits_;  // of the base, or null
  const SplineKnots* knots_;    // alike
  const NarrowSurfaces* narrow_;
  int nq_, d_, m_;  // of the base
};

}  // namespace contact_flow
