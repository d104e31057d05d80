// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// The directional derivative R'(x; w) of the reset (q, v) ↦ (q, v⁺) of a frictional impact (F6),
/// by the implicit function theorem on the equations of its word:
///   r₁ = M (v⁺ − v⁻) − W p = 0;   in contact N (v⁺ + γ v⁻) = 0,   sticking T v⁺ = 0,
/// with W = Nᵀ − μ Tᵀ d of what slips, d = s⁺/|s⁺|. Where the impulse lies on the border of its
/// cone, or vanishes, several words lead to the same v⁺, each a branch.
class FrictionalReset {
 public:
  struct Branch {
    ContactMode word;
    Matrix jacobian;  ///< DR [2d+k × 2d+k]
    Matrix borders;   ///< gradients of what has to stay positive and is zero here [· × 2d+k]
    /// Of a plastic contact that is hit and held: the speed with which it would bounce, by its
    /// restitution [2d+k], which `jacobian` leaves out, and what that adds to v⁺ for each unit [d].
    Eigen::RowVectorXd bounce_speed;
    Vector bounce;
  };

  /// `hit` approaches, the others of `touching` rest; `mode` is the contact mode before. Throws
  /// std::domain_error where a contact that rests is pushed or lifted, but so little that
  /// perturbations of that size decide whether it is.
  FrictionalReset(const ContactDynamics& dynamics, const Vector& x, ConstraintSet touching, int hit,
                  ContactMode mode, const Transition& cluster);

  const Vector& v_plus() const { return v_plus_; }
  /// The branch of w, whose entries are sums of terms of these `sizes`; `decide` is told each
  /// border that it lies on the positive side of. Throws std::domain_error where no branch fits.
  const Branch& Choose(const Vector& w, const Vector& sizes,
                       const std::function<void(const Eigen::RowVectorXd&)>& decide) const;

 private:
  Branch Differentiate(const FrictionSolution& solution, const Vector& v_plus, double scale) const;
  Matrix KeptRows(const Matrix& A, const Matrix& rate, const ParameterJacobian& by_parameter) const;
  static ConstraintSet Sharing(const MechanicalSystem& system, const InverseInertia& inertia,
                               const Vector& x, ConstraintSet touching, ConstraintSet persisting);
  void CheckBrushed(const FrictionSolution& solution, int hit, double scale) const;
  Vector FreeSlip(int i, const Vector& v_plus) const;

  const ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Vector x_;
  const int d_, nq_, size_;
  const double t_;
  const double border_;  // how closely the inequalities of the impact have to hold, relative
  const ConstraintSet persisting_, after_;
  const InverseInertia inertia_;
  FrictionFrame frame_;
  Vector v_plus_;
  std::vector<Branch> branches_;
};

/// (F7) of all contacts in `stopping` that stick in `mode`, at once:
///   Ξ = I − [0; M⁻¹ W (A M⁻¹ W)⁻¹ E] D(T v),
/// A and W those of (F3) in the mode, E the rows of A that belong to them. `rate_jacobian` is
/// D(A v) of all rows of the system [n+l+r × 2d+k].
Matrix StopProjection(ContactDynamics* dynamics, const Vector& x, ContactMode mode,
                      ConstraintSet stopping, const Matrix& rate_jacobian);

/// The same of contacts in `landing` that rose with a speed of first order, and are pressed back:
/// whatever the bounces were, impulses along their columns of W bring them to rest, and their
/// slips, where they stick.
Matrix LandingProjection(ContactDynamics* dynamics, const Vector& x, ContactMode mode,
                         ConstraintSet landing, const Matrix& rate_jacobian);

/// A⁻¹ B; where rows of A depend on others, one of the solutions. Rows and columns
/// are scaled by `unit`.
Matrix SolveConsistent(const Matrix& A, const Vector& unit, const Matrix& B);

/// D(A v) of all rows at x [n+l+r × 2d+k].
Matrix RateJacobian(const ContactDynamics& dynamics, const Vector& x);

}  // namespace contact_flow
