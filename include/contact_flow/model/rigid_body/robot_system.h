// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "contact_flow/model/effort_limits.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/narrow_surfaces.h"
#include "contact_flow/model/rigid_body/element_geometry.h"
#include "contact_flow/model/rigid_body/inverse_dynamics_jacobian.h"
#include "contact_flow/model/rigid_body/robot_description.h"
#include "contact_flow/model/spline_knots.h"

namespace contact_flow {

/// A robot as a mechanical system: M and the Coriolis terms from its RigidBodyTree, f from gravity
/// and its efforts, a and γ from its constraints, b from its closures. With z the points and joints
/// of an element, Z = ∂z/∂η, e its forces and g the gradient of a constraint,
///   h = −RNEA(q, v, 0) + Σ Zᵀ e(z, ż, u) + S G(q),       Da = gᵀ Z,
///   r₁ = RNEA(q, v, v̇) − Σ Zᵀ e − Σ Zᵀ g λ,
/// S the share of the weight G that actuators bear, u after StateFeedback;
/// and all derivatives are analytic along the tree, by duals within an element. With friction the
/// rows of a contact's map T = W Z, which it slips with (SlipKernel), follow those of closures.
class RobotSystem final : public MechanicalSystem,
                          public EffortLimits,
                          public SplineKnots,
                          public NarrowSurfaces {
 public:
  /// Values replace those of the description's parameters. Throws std::invalid_argument for unknown
  /// parameters and for values out of range.
  RobotSystem(RobotDescription robot, const ParameterValues& values);
  ~RobotSystem() override;

  const RobotDescription& robot() const { return robot_; }

  /// What springs, dampers, controllers and actuators put on each joint, forces on points of links
  /// left out [nv].
  Vector JointEfforts(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                      const ContactMode& mode) const;

  const std::vector<std::string>& limited_efforts() const override { return limited_names_; }
  void EffortShares(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                    const ContactMode& mode, Vector* share) const override;
  double TimeToKnot(const VectorRef& q, const VectorRef& v) const override;
  const std::vector<std::vector<double>>& knots_of_places() const override { return knots_; }
  void Places(const VectorRef& q, const ContactMode& mode, Vector* place) const override;
  bool HasNarrowSurfaces() const override { return !narrow_.empty(); }
  void Passages(const VectorRef& q, const VectorRef& v,
                std::vector<SurfacePassage>* passages) const override;
  bool HasConstantMass() const override { return constant_mass_; }
  bool HasAffineConstraints() const override { return affine_constraints_; }
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
  Matrix DifferentiateFriction(const std::vector<int>& parameters) const override;

 private:
  struct Scratch;
  /// Where scratch is kept between calls.
  struct Shelf {
    std::atomic<Scratch*> scratch{nullptr};
    ~Shelf();
  };
  /// Scratch of one call: the one on the shelf, or a new one while another thread has it.
  class Loan;

  const ConstraintElement& constraint(int i) const { return *all_constraints_[i]; }
  /// The unilateral constraints that are asked for, all where null, and the bilateral ones.
  template <class Visit>
  void VisitConstraints(const ConstraintSet* asked, const Visit& visit) const {
    const int n = num_constraints(), count = static_cast<int>(all_constraints_.size());
    for (int i = 0; asked == nullptr && i < n; ++i) visit(i);
    if (asked != nullptr) {
      for (int i : *asked) visit(i);
    }
    for (int i = n; i < count; ++i) visit(i);
  }
  /// Constraints and DifferentiateDynamics, with the rows of those asked for.
  void FillConstraints(const ConstraintSet* asked, const VectorRef& q, const VectorRef& v,
                       ConstraintTerms* terms) const;
  void FillJacobian(const ConstraintSet* asked, const VectorRef& q, const VectorRef& v,
                    const VectorRef& u, const ContactMode& mode, const VectorRef& acceleration,
                    const VectorRef& force, ResidualJacobian* jacobian) const;
  void Describe();
  void DescribeFriction();
  void DescribeKnots();
  /// Throws std::invalid_argument for a constraint without gradient and for numbers
  /// that are not finite.
  void CheckElements() const;
  /// Throws std::invalid_argument for a closure that those before it imply, at both states.
  void CheckClosures(const ConstraintTerms& nominal, const ConstraintTerms& around) const;
  /// The inputs after feedback, into s->input.
  void CloseLoop(const VectorRef& q, const VectorRef& v, const VectorRef& u, Scratch* s) const;
  /// The inputs of effort i into s->u, and how many switches of its reference lie behind.
  void TakeInputs(int i, const ContactMode& mode, Scratch* s) const;
  void AddEfforts(const VectorRef& q, const VectorRef& v, const ContactMode& mode,
                  Scratch* s) const;
  /// G(q) into s->weight, and what its derivatives need into s->resting.
  void Weigh(const VectorRef& q, Scratch* s) const;
  /// − ∂(S G)/∂η and what feedback makes of ∂r₁/∂u, once that is there.
  void DifferentiateControl(const VectorRef& q, Scratch* s, ResidualJacobian* jacobian) const;
  void AddConstraintForces(const VectorRef& q, const VectorRef& force, Scratch* s) const;
  /// Row of T of constraint i, −1 without friction.
  int slip_row(int i) const { return slip_rows_.empty() ? -1 : slip_rows_[i]; }
  // Of slip, each where the motion of the element is in `s`: T and Ṫ v; what of ∂r₁ and ∂r₂ is its;
  // the same of the impact; the same by a number.
  void AddSlipTerms(int i, Scratch* s, ConstraintTerms* terms) const;
  void DifferentiateSlip(int i, const VectorRef& force, Scratch* s,
                         ResidualJacobian* jacobian) const;
  void DifferentiateSlipAtImpact(int i, const VectorRef& impulse, Scratch* s,
                                 ResidualJacobian* jacobian) const;
  void SubtractSlipHessian(int i, const VectorRef& force, Scratch* s, Matrix* momentum_q) const;
  /// `speed`: of the impact, else null.
  void DifferentiateSlipByNumber(int i, int number, const VectorRef& force, const double* speed,
                                 Scratch* s, int column, ParameterJacobian* jacobian) const;
  void DifferentiateEffort(int i, const VectorRef& q, const VectorRef& v, const ContactMode& mode,
                           Scratch* s, ResidualJacobian* jacobian) const;
  void DifferentiateConstraint(int i, const VectorRef& q, const VectorRef& v,
                               const VectorRef& acceleration, const VectorRef& force, Scratch* s,
                               ResidualJacobian* jacobian) const;
  /// ∂RNEA/∂(number of a link, or gravity), after UpdateAccelerations and UpdateMomenta.
  void DifferentiateInertia(const NumberPlace& place, bool weight, const TreeState<double>& state,
                            double* column) const;
  void DifferentiateConstraintByNumber(int i, int number, const VectorRef& q, const VectorRef& v,
                                       const VectorRef& acceleration, const VectorRef& force,
                                       Scratch* s, int column, ParameterJacobian* jacobian) const;

  RobotDescription robot_;
  std::vector<const ConstraintElement*> all_constraints_;  // n unilateral, l bilateral
  std::vector<ElementGeometry> constraint_geometry_;
  std::vector<ElementGeometry> effort_geometry_;
  struct LimitedEffort {
    int effort;
    bool by_speed;
  };
  std::vector<LimitedEffort> limited_;
  std::vector<std::string> limited_names_;
  std::vector<std::vector<double>> knots_;  // of all places
  struct PlacedContact {
    int constraint;
    int first, count;  // of its places
  };
  std::vector<PlacedContact> placed_;  // those on surfaces with knots
  std::vector<int> narrow_;            // those whose surfaces may be narrow
  std::vector<int> slip_rows_;         // of every constraint; empty without friction
  bool constant_mass_ = false;
  bool affine_constraints_ = false;
  bool forces_on_points_ = false;
  mutable Shelf shelf_;
};

}  // namespace contact_flow
