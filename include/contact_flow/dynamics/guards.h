// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The functions of the state that stay positive along an arc, numbered. Guard i < n is the normal
/// one of constraint i: a_i where it is open, λ_n,i where it is in contact (−a_i if compliant).
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
  /// The guards of a mode that are functions of the contact forces, and those that are slips.
  ConstraintSet OfForces(ContactMode mode, ConstraintSet shared) const;
  ConstraintSet OfSlips(ContactMode mode) const;
  bool IsNormal(int guard) const { return guard < n_; }

  /// The guard as a function of the forces λ [n+l+r] where the dynamics were evaluated last.
  double OfForce(int guard, const ContactDynamics& at) const;
  /// Its gradient by λ, applied to the columns of `by` [n+l+r × ·].
  Eigen::RowVectorXd GradientOfForce(int guard, const ContactDynamics& at,
                                     const MatrixRef& by) const;
  /// Row of T and sign of a guard that is a slip.
  int SlipRow(int guard) const { return system_.friction()[ConstraintOf(guard)].row; }
  double SlipSign(int guard, ContactMode mode) const {
    return mode.LetterOf(ConstraintOf(guard)) == Letter::kBackward ? -1 : 1;
  }

 private:
  int SharedGuard(ConstraintSet shared) const;

  const MechanicalSystem& system_;
  const int n_;
  std::vector<int> contacts_;  // with friction
  std::vector<int> first_;     // OfFriction of each constraint, −1 without friction [n]
  int size_;
};

}  // namespace contact_flow
