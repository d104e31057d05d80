// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What a guard is in a contact mode.
enum class GuardKind {
  kGap,    ///< a_i of a contact that is open, −a_i of a compliant one that is pressed [m]
  kForce,  ///< λ_n,i of a rigid contact [N]
  kCone,   ///< what a force that sticks, or all that are shared, may grow by before it slips [N]
  kSlip,   ///< ± T v of a contact that slips in the plane, along its letter; |T v| in space [m/s]
};

/// Whether guards of this kind are functions of forces, which jump where others' events change the
/// mode. The others are functions of q and v.
constexpr bool IsOfForces(GuardKind kind) {
  return kind == GuardKind::kForce || kind == GuardKind::kCone;
}

/// A guard with its first two time derivatives along the mode; NaN: not asked for.
struct GuardJet {
  double value;
  double rate;
  double acceleration = std::numeric_limits<double>::quiet_NaN();
};

/// The gaps along a motion with acceleration q̈: a, ȧ = Da v and ä = Da q̈ + Ḋa v, all [n+l+r]; of
/// the tangential rows rate and acceleration are slip T v and its rate.
struct GapSample {
  Vector gap;
  Vector rate;
  Vector acceleration;
};

/// Direction of the slip of a letter in the plane.
constexpr double SlipSign(Letter letter) { return letter == Letter::kBackward ? -1 : 1; }

/// The functions of the state that stay positive along an arc, numbered: their kinds, signs, values
/// and rates are known here, their gradients to GuardGradients. Guard i < n is the normal one of
/// constraint i: a_i where it is open, λ_n,i where it is in contact (−a_i if compliant).
/// With friction there are two more for each contact i, n + 2i and n + 2i + 1; where that is more
/// than a ConstraintSet holds, for those with friction alone, one after another:
///   sticks, in the plane   μ λ_n + λ_t and μ λ_n − λ_t: it begins to slip forward, backward
///   sticks, in space       μ λ_n − |λ_t|, and none
///   slips, in the plane    the slip along its letter, ± T v, and none
/// A contact that sticks by finite friction has no normal guard: its cone is reached first.
/// Contacts that share forces (ContactDynamics::shared) have but one guard of forces among them,
/// their margin: the last one of the first of them that has more than its normal one.
class Guards {
 public:
  explicit Guards(const MechanicalSystem& system);

  int size() const { return size_; }
  int ConstraintOf(int guard) const {
    return guard < n_ ? guard : contacts_[static_cast<std::size_t>((guard - n_) / 2)];
  }
  /// The first one of contact i behind the normal ones; −1: none.
  int OfFriction(int i) const { return first_[static_cast<std::size_t>(i)]; }
  bool IsNormal(int guard) const { return guard < n_; }
  GuardKind KindOf(int guard, const ContactMode& mode, const ConstraintSet& shared = {}) const;

  /// The guards of a mode that are gaps, that are functions of the contact forces, and those that
  /// are slips in the plane.
  ConstraintSet OfGaps(const ContactMode& mode) const {
    return ConstraintSet::All(n_) - (mode - system_.compliant());
  }
  ConstraintSet OfForces(const ContactMode& mode, const ConstraintSet& shared) const;
  ConstraintSet OfSlips(const ContactMode& mode) const;

  /// A guard at x in `mode`, with its rate; evaluates the dynamics, or differentiates them, where
  /// it takes forces.
  GuardJet At(int guard, ContactDynamics* dynamics, const VectorRef& x,
              const ContactMode& mode) const;

  /// A guard that is a gap or a slip by the motion of the rows.
  GuardJet OfMotion(int guard, const ContactMode& mode, const GapSample& at) const {
    if (!IsNormal(guard)) return OfSlip(guard, mode, at);
    const double sign = GapSign(guard, mode);
    return {sign * at.gap(guard), sign * at.rate(guard), sign * at.acceleration(guard)};
  }
  /// The same at v [d], by what is known of the configuration; the acceleration v̇ [d] is asked for
  /// slips alone.
  GuardJet OfMotion(int guard, const ContactMode& mode, const ConstraintTerms& at,
                    const VectorRef& v, const Vector& acceleration) const;
  /// Of a constraint whose guard is its gap: −1 for a compliant member, whose guard is −a_i.
  static double GapSign(int i, const ContactMode& mode) { return mode.Contains(i) ? -1 : 1; }

  /// The guard as a function of the forces λ [n+l+r] where the dynamics were evaluated last, and
  /// its rate by theirs.
  double OfForce(int guard, const ContactDynamics& at) const;
  double RateOfForce(int guard, const ContactDynamics& at, const Vector& rates) const {
    return IsNormal(guard) ? rates(guard) : GradientOfForce(guard, at, rates)(0);
  }
  /// Its gradient by λ, applied to the columns of `by` [n+l+r × ·].
  Eigen::RowVectorXd GradientOfForce(int guard, const ContactDynamics& at,
                                     const MatrixRef& by) const;

 private:
  int SharedGuard(const ConstraintSet& shared) const;
  GuardJet OfSlip(int guard, const ContactMode& mode, const GapSample& at) const;
  GuardJet OfSlip(int guard, const ContactMode& mode, const VectorRef& slip,
                  const VectorRef& rate) const;

  const MechanicalSystem& system_;
  const int n_;
  std::vector<int> contacts_;  // with friction
  std::vector<int> first_;     // OfFriction of each constraint, −1 without friction [n]
  int size_;
};

}  // namespace contact_flow
