// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "walk_point.h"

namespace contact_flow {

/// What may happen to contacts at a base point of a walk.
struct ContactsAhead {
  ConstraintSet landing;    ///< touch
  ConstraintSet stopping;   ///< have no slip left, with a letter that slips
  ConstraintSet releasing;  ///< have no force left
  ConstraintSet bursting;   ///< are on their cones, where the acceleration jumps
};

/// A guard that is zero at the base point and vanishes for perturbed runs nearby.
struct WalkGuard {
  enum class Kind { kTouchdown, kStop, kOnset, kRelease, kInput } kind;
  int constraint;               ///< n + its number in the cluster where the input changes
  Eigen::RowVectorXd gradient;  ///< [2d+k]
  double rate;                  ///< along the field of the mode, < 0
};

/// The guards of the mode that vanish, touchdowns first. Forces that vanish and cones that are
/// reached change nothing to first order by themselves: they are told where a jump follows them,
/// a touchdown or the release of what never slips, or is theirs.
std::vector<WalkGuard> GuardsAhead(ContactDynamics* dynamics, const WalkPoint& point,
                                   ContactMode mode, const ContactsAhead& ahead);

/// Those of the contacts that never slip, μ = ∞.
ConstraintSet NeverSlipping(const MechanicalSystem& system, ConstraintSet contacts);

}  // namespace contact_flow
