// SPDX-License-Identifier: BSD-3-Clause
#include "force_slack.h"

#include <algorithm>
#include <cmath>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "src/dynamics/guard_gradients.h"
#include "src/dynamics/row_units.h"

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
  const ContactMode mode = transition.mode_before;
  const Vector& x = transition.x_minus;
  dynamics->Evaluate(x, mode);
  const ConstraintSet shared = dynamics->shared(), forces = guards.OfForces(mode, shared);
  if (std::none_of(transition.guards.begin(), transition.guards.end(),
                   [&](int guard) { return forces.Contains(guard); })) {
    return slack;
  }
  const double known = kInstant * std::max(1.0, std::abs(transition.t));
  const GuardGradients gradients(dynamics, x, mode, transition.guards.front());
  const InverseInertia inertia(system, x.head(system.num_positions()), x.tail(system.dof()));
  const FrictionFrame frame(system, inertia, mode);
  ConstraintSet alone;
  for (std::size_t k = 0; k < frame.constraints().size(); ++k) {
    if (StandsAlone(frame.problem(), k)) alone.Insert(frame.constraints()[k]);
  }
  for (int guard : transition.guards) {
    if (!forces.Contains(guard)) continue;
    const int i = guards.ConstraintOf(guard);
    const GuardGradients::Value at = gradients.At(guard);
    const double unsure = std::abs(at.gradient.dot(gradients.field())) * known;
    // One that vanishes a little later is not there yet.
    const double value = std::abs(at.value);
    const double missed = unsure + (value <= kReach * unsure ? 2 * value : 0);
    // The margin of shared forces is one of all who share them.
    const bool all = !guards.IsNormal(guard) && shared.Contains(i);
    for (int j : all ? shared : ConstraintSet({i})) {
      const Matrix row = inertia.terms().jacobian.row(j).transpose();
      const double mu = system.friction()[j].coefficient;
      double cone = guards.IsNormal(guard) || mu == 0 ? 1 : 1 / mu;
      if (!alone.Contains(j)) cone = std::max(1.0, cone);
      slack(j) += (row.transpose() * (inertia * row))(0) * missed * cone;
    }
  }
  return slack;
}

double LargestAcceleration(const ContactDynamics& dynamics, const Vector& x,
                           const ConstraintSet& touching) {
  const MechanicalSystem& system = dynamics.system();
  const InverseInertia inertia(system, x.head(system.num_positions()), x.tail(system.dof()),
                               dynamics.u(), ContactMode());
  const FrictionFrame frame(system, inertia, touching);
  if (frame.bias().size() == 0) return 0;
  FrictionProblem problem = frame.problem();
  problem.b = frame.rows() * inertia.FreeAcceleration() + frame.bias();
  return RowUnits(problem).Largest(problem.b);
}

}  // namespace contact_flow
