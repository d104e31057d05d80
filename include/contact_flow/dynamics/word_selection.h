// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/friction_problem.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Contacts with friction leave the motion undecided.
struct FrictionRefusal : std::runtime_error {
  enum class Kind {
    kInconsistent,         ///< no forces exist (Painlevé)
    kIndeterminate,        ///< several motions fit (Painlevé)
    kIndeterminateForces,  ///< rows of what sticks are dependent
    kNoImpact,             ///< no impulses exist
    kAmbiguousImpact,      ///< several velocities fit
    kEnergyGain,           ///< an impact would add energy
    kSlipFromRestInSpace,  ///< a contact in space begins to slip
  };
  FrictionRefusal(Kind kind, const std::string& what) : std::runtime_error(what), kind(kind) {}
  Kind kind;
};

/// The rows (N_i, T_i) of some contacts at one state, contact by contact, and what they make of the
/// inertia: the (F4) of accelerations and of impulses.
class FrictionFrame {
 public:
  FrictionFrame(const MechanicalSystem& system, const InverseInertia& inertia,
                const ConstraintSet& contacts);

  const Matrix& rows() const { return rows_; }    ///< A [m×d]
  const Matrix& reach() const { return reach_; }  ///< P Aᵀ [d×m]
  const std::vector<int>& constraints() const { return constraints_; }
  /// With G = A P Aᵀ, b left open, no contact slipping.
  const FrictionProblem& problem() const { return problem_; }
  FrictionProblem& problem() { return problem_; }
  /// d/dt A v of each row [m].
  const Vector& bias() const { return bias_; }
  /// What A v is known to by row [m]: where contacts of `before` rest, and stick, any value
  /// is zero.
  Vector RateRounding(const InverseInertia& inertia, const VectorRef& v,
                      const ContactMode& before) const;
  /// v⁺ = v⁻ + P Aᵀ p of an impact's solution, with b = (1 + γ) N v⁻ and T v⁻. Where the rows of
  /// its word are badly conditioned, v⁺ and p by the equations of the word once more.
  Vector VelocityAfter(const InverseInertia& inertia, const Vector& v_minus,
                       FrictionSolution* solution) const;
  /// The impulse of the system [n+l+r] with p [m] of this frame's rows: zero in those of other
  /// contacts, and what bilateral constraints answer to it.
  Vector Impulse(const InverseInertia& inertia, const Vector& p) const;

 private:
  const MechanicalSystem& system_;
  std::vector<int> constraints_;
  std::vector<int> system_rows_;
  Matrix rows_, reach_;
  Vector bias_;
  FrictionProblem problem_;
};

/// What the tangential state of a touching contact is taken for.
struct TouchingContacts {
  ConstraintSet still;   ///< T v = 0: it sticks, or begins to slip
  ContactMode slipping;  ///< T v ≠ 0; letters give the direction in the plane
  /// By constraint, what inequalities of accelerations may miss [m/s²]: of guards of forces that
  /// vanish here (ForceSlack). Words that miss by no more are decided by the rates. Empty for none.
  Vector slack;
  /// The letters until now, unless an impact has come between: where several motions go on, theirs.
  ContactMode before;
  /// They have ended at once again and again: another motion follows, if one fits.
  bool ended = false;
};

/// What decided a word beside the laws: a convention, that is to be told.
struct WordConventions {
  bool springs = false;  ///< how forces are shared decides: as equal springs would
  bool turns = false;    ///< slips of one body begin in several directions
  /// Several motions fit, none of which is known to go on: the only one that fits a little later.
  bool ahead = false;
  /// Several motions go on, or several impulses end an impact: that of the letters until now, else
  /// the smallest forces, λᵀ A M⁻¹ Aᵀ λ.
  bool smallest = false;
  std::string motions;  ///< where several go on, each with what it makes of the contacts
};

/// The contact mode of a state whose touching contacts rest in normal direction, (F4) for the
/// accelerations. Where several words fit, because an inequality holds with equality within
/// `border`, the one that goes on to hold: its inequalities of the contacts whose letters differ
/// among the words grow along its own motion. Throws FrictionRefusal where none do. `by` tells what
/// conventions decided; where nobody asks, several motions are refused, and those of springs.
ContactMode SelectWord(ContactDynamics* dynamics, const VectorRef& x,
                       const TouchingContacts& touching, double border,
                       WordConventions* by = nullptr);

/// The impact (F6) of the touching contacts K:
///   M (v⁺ − v⁻) = A_Kᵀ p + Bᵀ r,   0 ≤ p_n ⟂ N v⁺ + γ N v⁻ ≥ 0,   |p_t| ≤ μ p_n,
///   s⁺ ≠ 0 ⇒ p_t = −μ p_n s⁺/|s⁺|,   s⁺ = T v⁺.
/// Newton–Moreau in normal direction, Coulomb in the impulses, no tangential restitution.
struct FrictionalImpact {
  ImpactResult result;
  ContactMode word;          ///< a letter for each contact with an impulse
  double energy_change = 0;  ///< ½ pᵀ (A v⁻ + A v⁺) [J]
  bool springs = false;      ///< how impulses are shared decides v⁺: as by equal springs
};
/// `before` are those that rested, and stuck, by letter. Contacts that rest to rounding and feel
/// nobody who does not take no part. Throws FrictionRefusal where no v⁺ fits, or several do and
/// nobody asks by which convention, or energy would be gained by more than rounding.
FrictionalImpact SolveFrictionalImpact(const MechanicalSystem& system, const VectorRef& q,
                                       const VectorRef& v_minus, const ConstraintSet& touching,
                                       const ContactMode& before = ContactMode(),
                                       WordConventions* by = nullptr);

}  // namespace contact_flow
