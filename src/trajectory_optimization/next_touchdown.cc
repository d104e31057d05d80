// SPDX-License-Identifier: BSD-3-Clause
#include "next_touchdown.h"

#include <algorithm>
#include <cmath>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/word_selection.h"

namespace contact_flow {

std::optional<NextTouchdown> TouchdownBehind(const MechanicalSystem& system,
                                             const Trajectory& run) {
  const Arc& last = run.arcs.back();
  const int d = system.dof(), nq = system.num_positions();
  const Vector v = last.x_end.tail(d);
  ConstraintTerms terms;
  system.Constraints(last.x_end.head(nq), v, &terms);
  Vector acceleration;
  try {
    ContactDynamics dynamics(system, last.u);
    acceleration = dynamics.Field(last.x_end, last.mode).segment(d, d);
  } catch (const FrictionRefusal&) {
    return {};
  }
  std::optional<NextTouchdown> next;
  for (int i = 0; i < system.num_constraints(); ++i) {
    if (last.mode.Contains(i) || system.compliant().Contains(i)) continue;
    const Eigen::RowVectorXd row = terms.jacobian.row(i);
    const double gap = std::max(terms.gap(i), 0.0), rate = row.dot(v);
    const double bend = row.dot(acceleration), square = rate * rate - 2 * bend * gap;
    if (!(square > 0)) continue;
    // The root at which the gap closes: its rate there is −√square.
    const double root = std::sqrt(square);
    const double after = rate < 0 ? 2 * gap / (root - rate) : (root + rate) / -bend;
    if (!(after >= 0) || !std::isfinite(after)) continue;
    if (!next || after < next->after) next = NextTouchdown{i, after, -root, row};
  }
  return next;
}

bool IsMetAtEnd(const MechanicalSystem& system, const Trajectory& run, double interval) {
  for (const Transition& event : run.transitions) {
    const bool met = !(event.activated | event.switched).Empty();
    if (met && run.t_end() - event.t <= interval) return true;
  }
  const std::optional<NextTouchdown> next = TouchdownBehind(system, run);
  return next && next->after <= interval;
}

}  // namespace contact_flow
