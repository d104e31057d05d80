// SPDX-License-Identifier: BSD-3-Clause
#include "stop_in_space.h"

#include <algorithm>

namespace contact_flow {
namespace {

/// A slip that would end within this time ends at once, for tangents, too [s].
constexpr double kSudden = 1e-8;
/// Of a slip, relative to the velocities.
constexpr double kStopRounding = 1e-12;

}  // namespace

ConstraintSet StoppedTogether(const MechanicalSystem& system, const ConstraintTerms& terms,
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
  ConstraintSet stopped{trigger};
  const Vector v = transition->x_minus.tail(system.dof()).cwiseAbs();
  for (int i : transition->mode_before) {
    const Friction& friction = system.friction()[i];
    if (friction.dimension != 2) continue;
    const double rounding =
        kStopRounding * (terms.jacobian.middleRows<2>(friction.row).cwiseAbs() * v).maxCoeff();
    const double slow = std::max({2 * speed, rounding, transition->absolute_tolerance});
    if (rate.segment<2>(friction.row).norm() <= slow) stopped.Insert(i);
  }
  return stopped;
}

}  // namespace contact_flow
