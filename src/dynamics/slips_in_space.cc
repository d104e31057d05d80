// SPDX-License-Identifier: BSD-3-Clause
#include "slips_in_space.h"

namespace contact_flow {

ConstraintSet SlipsInSpace(const MechanicalSystem& system, const ContactMode& mode) {
  ConstraintSet slips;
  if (!system.HasFriction()) return slips;
  for (int i : mode) {
    const Friction& friction = system.friction()[i];
    const bool in_space = friction.dimension == 2 && friction.coefficient > 0;
    if (in_space && mode.LetterOf(i) == Letter::kSlip) slips.Insert(i);
  }
  return slips;
}

}  // namespace contact_flow
