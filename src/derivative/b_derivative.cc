// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/b_derivative.h"

#include <Eigen/QR>
#include <memory>
#include <sstream>

#include "contact_flow/derivative/variation.h"
#include "contact_flow/dynamics/contact_dynamics.h"

namespace contact_flow {

Vector BDerivative::operator()(const VectorRef& w) const {
  Vector tangent = arcs.front() * w;
  for (std::size_t k = 0; k < events.size(); ++k) tangent = arcs[k + 1] * events[k](tangent);
  return tangent;
}

Vector BDerivative::operator()(double dt, const VectorRef& w) const {
  return dt * time + (*this)(w);
}

std::vector<ContactMode> BDerivative::PerturbedModes(const VectorRef& w) const {
  std::vector<ContactMode> modes = {initial_mode};
  Vector tangent = arcs.front() * w;
  for (std::size_t k = 0; k < events.size(); ++k) {
    const std::vector<ContactMode> passed = events[k].PerturbedModes(tangent);
    modes.insert(modes.end(), passed.begin(), passed.end());
    tangent = arcs[k + 1] * events[k](tangent);
  }
  return modes;
}

bool BDerivative::IsDifferentiable() const {
  if (!status.ok()) return false;
  for (const EventMap& event : events) {
    if (!event.IsDifferentiable(options.kink_tolerance)) return false;
  }
  return true;
}

PiecewiseLinearMap BDerivative::Pieces() const {
  PiecewiseLinearMap map = PiecewiseLinearMap::Linear(arcs.front());
  for (std::size_t k = 0; k < events.size(); ++k) {
    map = events[k].Pieces(options.max_activations_for_pieces).After(map, options.max_pieces);
    map = PiecewiseLinearMap::Linear(arcs[k + 1]).After(map, options.max_pieces);
  }
  return map;
}

BDerivative DifferentiateOutcome(const MechanicalSystem& system, const Trajectory& trajectory,
                                 const VectorRef& u, const BDerivativeOptions& options) {
  BDerivative derivative;
  derivative.options = options;
  derivative.status = trajectory.status;
  derivative.initial_mode = trajectory.arcs.front().mode;
  if (!derivative.status.ok()) return derivative;
  const auto dynamics = std::make_shared<ContactDynamics>(system, u);
  derivative.events.reserve(trajectory.transitions.size());
  for (const Transition& transition : trajectory.transitions) {
    if (transition.completes_zeno) {
      std::ostringstream message;
      message << "infinitely many bounces were completed to sticking at t = " << transition.t
              << " s: the outcome has no derivative by Theorem 1 (Def. 2 fails)";
      derivative.status = {Outcome::kZeno, message.str()};
      return derivative;
    }
    derivative.events.emplace_back(dynamics, transition);
    if (!derivative.events.back().status().ok()) {
      derivative.status = derivative.events.back().status();
      return derivative;
    }
  }
  for (const Arc& arc : trajectory.arcs) {
    derivative.arcs.push_back(PropagateArc(dynamics.get(), arc, options.tolerance));
  }
  derivative.time = dynamics->Field(trajectory.FinalState(), trajectory.arcs.back().mode);
  return derivative;
}

Vector ProjectAdmissible(const MechanicalSystem& system, const VectorRef& x, ContactMode mode,
                         const VectorRef& w) {
  if (mode.Empty()) return w;
  const int d = system.dof(), k = mode.Size();
  // Rows of D(a_J, Da_J v): [A 0; D_q(A v) A].
  ConstraintTerms terms;
  system.Constraints(x.head(d), x.tail(d), &terms);
  ResidualJacobian residual;
  system.DifferentiateImpact(x.head(d), Vector::Zero(d), Vector::Zero(system.num_constraints()),
                             x.tail(d), &residual);
  Matrix rows = Matrix::Zero(2 * k, 2 * d);
  int row = 0;
  for (int i : mode) {
    rows.row(row).head(d) = terms.jacobian.row(i);
    rows.row(k + row).head(d) = residual.constraint_q.row(i);
    rows.row(k + row).tail(d) = terms.jacobian.row(i);
    ++row;
  }
  return w - rows.completeOrthogonalDecomposition().solve(rows * w);
}

}  // namespace contact_flow
