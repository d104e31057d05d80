// SPDX-License-Identifier: BSD-3-Clause
#include "departures.h"

#include <cmath>

#include "contact_flow/dynamics/guards.h"
#include "row_accelerations.h"

namespace contact_flow {
namespace {

/// An acceleration, or a force, that is none of rounding, relative to its terms; and where the
/// force of the contact has just passed zero, to what the instant of that is known to.
constexpr double kLifts = 1e-11, kLiftsBehindRelease = 1e-6;

/// The contacts whose own guards vanish at the event, or the cluster, before arc k.
ConstraintSet LetGoBefore(const MechanicalSystem& system, const Trajectory& trajectory,
                          const BDerivative& derivative, std::size_t k) {
  ConstraintSet contacts;
  const Guards guards(system);
  for (bool more = k > 0; more; --k) {
    const Transition& transition = trajectory.transitions[k - 1];
    contacts = contacts | transition.vanishing;
    for (int guard : transition.guards) contacts.Insert(guards.ConstraintOf(guard));
    more = k > 1 && derivative.events[k - 1].absorbed();
  }
  return contacts;
}

/// Rigid contacts beyond the mode of an arc that rest on their surfaces as it begins.
ConstraintSet Touching(const MechanicalSystem& system, const Trajectory& trajectory,
                       const Arc& arc) {
  const Vector v = arc.x_begin.tail(system.dof());
  ConstraintTerms terms;
  system.Constraints(arc.x_begin.head(system.num_positions()), v, &terms);
  ConstraintSet touching;
  for (int i : ConstraintSet::All(system.num_constraints()) - arc.mode - system.compliant()) {
    const bool rests = std::abs(terms.jacobian.row(i).dot(v)) <= trajectory.speed_tolerance;
    if (rests && std::abs(terms.gap(i)) <= trajectory.gap_tolerance) touching.Insert(i);
  }
  return touching;
}

bool NeverSlips(const MechanicalSystem& system, int i) {
  return system.HasFriction() &&
         std::isinf(system.friction()[static_cast<std::size_t>(i)].coefficient);
}

}  // namespace

std::vector<Departure> FindDepartures(ContactDynamics* dynamics, const Trajectory& trajectory,
                                      const BDerivative& derivative, std::size_t k) {
  std::vector<Departure> departures;
  const MechanicalSystem& system = dynamics->system();
  const Arc& arc = trajectory.arcs[k];
  const ConstraintSet touching = Touching(system, trajectory, arc);
  if (touching.Empty()) return departures;
  const ConstraintSet let_go = LetGoBefore(system, trajectory, derivative, k);
  const RowAccelerations leaving(dynamics, arc.x_begin, arc.mode);
  for (int i : touching) {
    const double least = let_go.Contains(i) ? kLiftsBehindRelease : kLifts;
    if (!(leaving.At(i) > least * leaving.Terms(i))) continue;
    departures.push_back({i, leaving.At(i), leaving.Rate(i), leaving.Gradient(i)});
    if (!NeverSlips(system, i)) continue;
    ContactMode held = arc.mode;
    held.Set(i, Letter::kStick);
    dynamics->Differentiate(arc.x_begin, held);
    const double pull = -dynamics->force()(i);
    if (!(pull > least * dynamics->force().cwiseAbs().maxCoeff())) continue;
    const Eigen::RowVectorXd gradient = -dynamics->force_jacobian().row(i);
    const double rate = gradient.dot(dynamics->Field(arc.x_begin, arc.mode));
    departures.push_back({i, pull, rate, gradient});
  }
  return departures;
}

}  // namespace contact_flow
