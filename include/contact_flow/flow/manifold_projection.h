// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Whether states have to satisfy anything at all: unit quaternions, b(q) = 0.
bool HasStateManifold(const MechanicalSystem& system);

/// Moves x = (q, v) [nq+d] onto the state manifold: unit quaternions, then b(q) = 0 by Newton steps
/// that are shortest in the kinetic metric, then Db v = 0 likewise. After a step of an integrator
/// this changes x by the order of the step's error, which leaves the order of accuracy (Hairer,
/// Lubich, Wanner, Geometric Numerical Integration, Sec. IV.4). False when the Newton steps
/// do not converge, or move a coordinate by more than `farthest`: onto another branch of b = 0.
bool ProjectState(const MechanicalSystem& system, Vector* x,
                  double farthest = std::numeric_limits<double>::infinity());

/// The same with the contacts of `held`: a_i = 0 and Da_i v = 0 besides, and T v = 0 of those that
/// stick. Undoes what resting contacts have drifted, of the order of the integrator's error, so
/// that the state is an initial one. Rates that rows which depend on each other cannot have, as
/// they are at odds, stay. False when it does not converge: x is then as it was.
bool ProjectContacts(const MechanicalSystem& system, ContactMode held, Vector* x);

/// What that would do to v at (q, v), q staying as it is.
struct HeldRates {
  std::vector<int> rows;  ///< that are held
  Vector left;            ///< their rates behind it, which no change of v takes away
  Vector change;          ///< of v [d]
  /// Kinetic size of the change, beside that which takes away the rate of a single row, the largest
  /// of them: large where rows are nearly dependent and at odds.
  double amplified = 0;
};
HeldRates RatesOfHeld(const MechanicalSystem& system, ContactMode held, const Vector& x);

}  // namespace contact_flow
