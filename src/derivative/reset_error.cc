// SPDX-License-Identifier: BSD-3-Clause
#include "reset_error.h"

#include <algorithm>
#include <cmath>

#include "src/dynamics/slips_in_space.h"

namespace contact_flow {
namespace {

constexpr double kLastPart = 1.0 / 16;  // of an arc: accelerations there are those at its end
constexpr double kSmallest = 4e-16;     // of such a part [s]
constexpr double kStopSafety = 2;

/// The part of a transition's speeds of approach ȧ that errors e [2d+k] of the state leave unknown:
///   δȧ = Da δv + D(Da v) δq + ä δt,   δt = −Da δq / ȧ,
/// with the acceleration over the last part of the arc before it.
double RelativeRateError(const MechanicalSystem& system, const Arc& arc,
                         const Transition& transition, const Probes& errors) {
  const int d = system.dof(), nq = system.num_positions();
  const Vector q = transition.x_minus.head(nq), v = transition.x_minus.tail(d);
  ConstraintTerms terms;
  system.Constraints(q, v, &terms);
  ResidualJacobian residual;
  system.DifferentiateImpact(q, Vector::Zero(d), Vector::Zero(terms.gap.size()), v, &residual);
  const double part = kLastPart * (arc.t_end - arc.t_begin);
  Vector x = transition.x_minus;
  if (part > 0) arc.dense.Evaluate(arc.t_end - part, x.data());
  const Vector acceleration = (v - x.tail(d)) / std::max(part, kSmallest);
  double largest = 0;
  for (int i : transition.activated | transition.switched) {
    const auto row = terms.jacobian.row(i);
    const double speed = row.dot(v), bend = row.dot(acceleration) + terms.bias(i);
    double squared = 0;
    for (const Vector& e : errors) {
      const double error = row.dot(e.segment(d, d)) + residual.constraint_q.row(i).dot(e.head(d)) -
                           bend * row.dot(e.head(d)) / speed;
      squared += error * error;
    }
    largest = std::max(largest, std::sqrt(squared / kProbes) / std::abs(speed));
  }
  return largest;
}

/// A slip in space is ended when little of it is left, and the tangents with it: by |s|/|ṡ| [s] too
/// early, by which they would still have moved.
double TimeOfSlipLeft(ContactDynamics* dynamics, const Transition& transition) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions();
  double longest = 0;
  for (int i : transition.mode_before& transition.mode_after.Sticking()) {
    if (transition.mode_before.LetterOf(i) != Letter::kSlip) continue;
    const Friction& friction = system.friction()[i];
    ConstraintTerms terms;
    system.Constraints(transition.x_minus.head(nq), transition.x_minus.tail(d), &terms);
    dynamics->Evaluate(transition.x_minus, transition.mode_before);
    const auto T = terms.jacobian.middleRows(friction.row, friction.dimension);
    const double slowing =
        (T * dynamics->acceleration() + terms.bias.segment(friction.row, friction.dimension))
            .norm();
    longest = std::max(longest, (T * transition.x_minus.tail(d)).norm() / slowing);
  }
  return kStopSafety * longest;
}

/// By how much what is left of a slip that ends turns others that go on, in space and slowly.
double TurnOfOthers(const MechanicalSystem& system, const Transition& transition) {
  if (!transition.activated.Empty()) return 0;
  const ConstraintSet slipping =
      SlipsInSpace(system, transition.mode_before) & SlipsInSpace(system, transition.mode_after);
  if (slipping.Empty()) return 0;
  const int d = system.dof(), nq = system.num_positions();
  const Vector v = transition.x_plus.tail(d), jump = v - transition.x_minus.tail(d);
  double largest = 0;
  ConstraintTerms terms;
  system.Constraints(transition.x_plus.head(nq), v, &terms);
  for (int i : slipping) {
    const auto T = terms.jacobian.middleRows<2>(system.friction()[i].row);
    largest = std::max(largest, (T * jump).norm() / (T * v).norm());
  }
  return largest;
}

}  // namespace

double RelativeResetError(ContactDynamics* dynamics, const Arc& arc, const Transition& transition,
                          const Probes& errors) {
  return RelativeRateError(dynamics->system(), arc, transition, errors) +
         TimeOfSlipLeft(dynamics, transition) + TurnOfOthers(dynamics->system(), transition);
}

}  // namespace contact_flow
