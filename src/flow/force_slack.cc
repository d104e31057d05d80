// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/force_slack.h"

#include <algorithm>
#include <cmath>

#include "contact_flow/dynamics/guard_gradients.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/inverse_inertia.h"

namespace contact_flow {
namespace {

/// What the instant of a located event is known to on its own trajectory, relative to max(1, t).
constexpr double kInstant = 1e-13;
/// What vanishes within this many times that is zero.
constexpr double kReach = 100;

}  // namespace

Vector ForceSlack(ContactDynamics* dynamics, const Transition& transition) {
  const MechanicalSystem& system = dynamics->system();
  Vector slack = Vector::Zero(system.num_constraints());
  const Guards guards(system);
  const ContactMode mode = transition.mode_before, forces = guards.OfForces(mode);
  if (std::none_of(transition.guards.begin(), transition.guards.end(),
                   [&](int guard) { return forces.Contains(guard); })) {
    return slack;
  }
  const double known = kInstant * std::max(1.0, std::abs(transition.t));
  const Vector& x = transition.x_minus;
  const GuardGradients gradients(dynamics, x, mode, transition.guards.front());
  const InverseInertia inertia(system, x.head(system.num_positions()), x.tail(system.dof()));
  for (int guard : transition.guards) {
    if (!forces.Contains(guard)) continue;
    const int i = guards.ConstraintOf(guard);
    const GuardGradients::Value at = gradients.At(guard);
    const double unsure = std::abs(at.gradient.dot(gradients.field())) * known;
    // One that vanishes a little later is not there yet.
    const double value = std::abs(at.value);
    const double missed = unsure + (value <= kReach * unsure ? 2 * value : 0);
    const Matrix row = inertia.terms().jacobian.row(i).transpose();
    const double coefficient = guards.IsNormal(guard) ? 1 : system.friction()[i].coefficient;
    slack(i) += (row.transpose() * (inertia * row))(0) * missed * std::max(1.0, 1 / coefficient);
  }
  return slack;
}

}  // namespace contact_flow
