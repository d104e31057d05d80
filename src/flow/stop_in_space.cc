// SPDX-License-Identifier: BSD-3-Clause
#include "stop_in_space.h"

namespace contact_flow {
namespace {

/// A slip that would end within this time ends at once, for tangents, too [s].
constexpr double kSudden = 1e-8;

}  // namespace

ContactMode StoppedTogether(const MechanicalSystem& system, const ConstraintTerms& terms,
                            const Vector& acceleration, int trigger, Transition* transition) {
  const Vector rate = terms.jacobian * transition->x_minus.tail(system.dof());
  const Vector change = terms.jacobian * acceleration + terms.bias;
  const int row = system.friction()[trigger].row;
  const double speed = rate.segment<2>(row).norm();
  if (speed > kSudden * change.segment<2>(row).norm()) {
    transition->obstacle = {Outcome::kNotDifferentiable,
                            "contact '" + system.description().constraints[trigger] +
                                "' comes to stick in space too slowly: no derivative"};
  }
  ContactMode stopped{trigger};
  for (int i : transition->mode_before) {
    const Friction& friction = system.friction()[i];
    const bool slow =
        friction.dimension == 2 && rate.segment<2>(friction.row).norm() <= 2 * speed;
    if (slow) stopped.Insert(i);
  }
  return stopped;
}

}  // namespace contact_flow
