// SPDX-License-Identifier: BSD-3-Clause
#include "event_order.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <sstream>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "src/dynamics/guard_gradients.h"

namespace contact_flow {
namespace {

/// Whether slips end and nothing else happens. Such events commute: the impulse that ends all slips
/// is the same in any order (friction, Sec. 4.2).
bool OnlyStops(const Transition& transition) {
  const ContactMode before = transition.mode_before, after = transition.mode_after;
  if (before.Members() != after.Members() || !transition.activated.Empty()) return false;
  for (int i : before) {
    const bool same = before.LetterOf(i) == after.LetterOf(i);
    if (!same && after.LetterOf(i) != Letter::kStick) return false;
  }
  return before != after;
}

}  // namespace

void KeepContacts(const MechanicalSystem& system, const Transition& transition,
                  const std::vector<Vector*>& errors) {
  const ConstraintSet held = transition.mode_before - system.compliant();
  if (held.Empty()) return;
  const int d = system.dof(), nq = system.num_positions();
  const Vector q = transition.x_minus.head(nq), v = transition.x_minus.tail(d);
  const InverseInertia inertia(system, q, v);
  ResidualJacobian residual;
  system.DifferentiateImpact(q, Vector::Zero(d), Vector::Zero(system.num_rows()), v, &residual);
  const Matrix A = inertia.Rows(held), reach = inertia * A.transpose();
  const Eigen::LLT<Matrix> factor(A * reach);
  if (factor.info() != Eigen::Success) return;
  Vector gap(held.Size());
  Matrix turn(held.Size(), d);
  Eigen::Index row = 0;
  for (int i : held) {
    gap(row) = inertia.terms().gap(i);
    turn.row(row++) = residual.constraint_q.row(i);
  }
  for (Vector* e : errors) {
    e->head(d) -= reach * factor.solve(A * e->head(d) - gap);
    e->segment(d, d) -= reach * factor.solve(A * (e->segment(d, d) - v) + turn * e->head(d));
  }
}

Eigen::RowVectorXd InstantGradient(ContactDynamics* dynamics, const Transition& transition) {
  const MechanicalSystem& system = dynamics->system();
  const Eigen::Index states = 2 * system.dof();
  const Eigen::RowVectorXd none = Eigen::RowVectorXd::Zero(states);
  if (transition.instants.empty()) return none;
  const int first = transition.instants.front().constraint;
  if (first >= system.num_constraints()) return none;  // the grid of the input stays where it is
  const bool named = system.HasFriction() && !transition.guards.empty();
  const int trigger = named ? transition.guards.front() : first;
  const GuardGradients gradients(dynamics, transition.x_minus, transition.mode_before, trigger);
  const Eigen::RowVectorXd gradient = gradients.At(trigger).gradient;
  const double rate = gradient.dot(gradients.field());
  return rate != 0 ? Eigen::RowVectorXd(-gradient.head(states) / rate) : none;
}

Status CheckOrder(const MechanicalSystem& system, const Transition& before, const Transition& after,
                  const std::vector<double>& first, const std::vector<double>& second) {
  if (before.instants.empty() || after.instants.empty()) return {};
  const int i = before.instants.front().constraint, j = after.instants.front().constraint;
  const int n = system.num_constraints();
  if (i == j || i >= n || j >= n) return {};  // its own events follow each other
  if (OnlyStops(before) && OnlyStops(after)) return {};
  double squared = 0;
  for (std::size_t k = 0; k < first.size(); ++k) {
    const double apart = second[k] - first[k];
    squared += apart * apart;
  }
  const double error = std::sqrt(squared / static_cast<double>(first.size()));
  const double interval = after.t - before.t;
  if (!(kInstantErrors * error > interval)) return {};
  const auto& names = system.description().constraints;
  std::ostringstream message;
  message.precision(12);
  message << "the events of '" << names[i] << "' at t = " << before.t << " s and of '" << names[j]
          << "' " << interval << " s later are closer than errors of the state tell apart ("
          << error << " s): their order is not known, and a tighter tolerance may tell it";
  return {Outcome::kNotDifferentiable, message.str()};
}

}  // namespace contact_flow
