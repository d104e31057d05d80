// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <vector>

#include "contact_flow/constraint_set.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Constraints that touch along an arc because its mode holds them: Da_i = Σ_j c_j Da_j over its
/// members. They have no guards, their gaps being rounding and what the members' drift brings,
///   a_i(t) − a_i(0) = Σ_j c_j (a_j(t) − a_j(0)),
/// so that what they move by beyond that is motion.
class ImpliedGaps {
 public:
  /// Those of `near` that the rigid contacts of a mode imply at x, where gaps are `gap` [n].
  void Find(const MechanicalSystem& system, const Vector& x, const VectorRef& u,
            ConstraintSet rigid, ConstraintSet near, const Vector& gap);
  /// Others without guards, that nothing holds.
  void Add(ConstraintSet others, const Vector& gap);
  void Erase(int i) { shares_.erase(i); }

  ConstraintSet constraints() const;
  bool Empty() const { return shares_.empty(); }
  /// How much contact i has moved since, but for the drift of what holds it [m].
  double Moved(int i, const Vector& gap) const;

 private:
  std::map<int, Vector> shares_;  // c_j of each, by members_
  std::vector<int> members_;
  Vector begin_;  // gaps at the beginning [n]
};

}  // namespace contact_flow
