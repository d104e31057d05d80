// SPDX-License-Identifier: BSD-3-Clause
#include "cluster_returns.h"

#include <stdexcept>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "validity_margins.h"

namespace contact_flow {
namespace {

/// Of a rate, beside the sizes of what it is the sum of.
constexpr double kRateRounding = 1e-12;

}  // namespace

void ConsiderReturns(const MechanicalSystem& system, const EventMap& event, const VectorRef& w,
                     ValidityRadius* smallest) {
  if (event.absorbed() || event.num_activations() < 2) return;
  EventPiece piece;
  try {
    piece = event.PieceAlong(w);
  } catch (const std::domain_error&) {
    return;
  }
  if (piece.velocities.empty()) return;
  const Transition& transition = event.transition();
  const int d = system.dof(), nq = system.num_positions();
  const Vector times = piece.times * w;
  ConstraintSet touching = transition.mode_before - system.compliant();
  for (std::size_t n = 0; n + 1 < piece.order.size(); ++n) {
    const auto row = static_cast<Eigen::Index>(n);
    if (!event.IsInputChange(piece.order[n])) touching.Insert(piece.order[n]);
    const double apart = times(row + 1) - times(row);
    if (!(apart > 0)) continue;
    const Vector& v = piece.velocities[n];
    Vector x(nq + d);
    x << transition.x_minus.head(nq), v;
    ContactDynamics dynamics(system, piece.inputs[n]);
    dynamics.Evaluate(x, piece.modes[n]);
    ConstraintTerms terms;
    system.Constraints(x.head(nq), v, &terms);
    for (int i : touching - piece.modes[n] - system.compliant()) {
      const double rate = terms.jacobian.row(i).dot(v);
      const double size = terms.jacobian.row(i).cwiseAbs().dot(v.cwiseAbs());
      const double rise = terms.jacobian.row(i).dot(dynamics.acceleration()) + terms.bias(i);
      if (!(rate > kRateRounding * size) || !(rise < 0)) continue;
      Consider(2 * rate / -rise, -apart, ValidityRadius::Limit::kGap, i, transition.t, smallest);
    }
  }
}

}  // namespace contact_flow
