// SPDX-License-Identifier: BSD-3-Clause
#include "error_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

constexpr int kProbes = 4;
/// Calibrated on random systems: the true errors stay below the estimates in 99 % of the runs.
constexpr double kStateSafety = 1;
constexpr double kDerivativeSafety = 1;

/// Signs that repeat to the bit: of entry i in the place `site` for one probe.
double Sign(int probe, std::size_t site, Eigen::Index i) {
  std::uint64_t x = (static_cast<std::uint64_t>(probe) << 48) ^ (site << 24) ^
                    static_cast<std::uint64_t>(i + 1);
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;  // splitmix64
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return ((x ^ (x >> 31)) & 1) != 0 ? 1 : -1;
}

/// size_i times a sign, for every entry.
Vector Signed(int probe, std::size_t site, const Vector& size) {
  Vector result(size.size());
  for (Eigen::Index i = 0; i < size.size(); ++i) result(i) = Sign(probe, site, i) * size(i);
  return result;
}

/// x += what errors of these sizes in its first entries may be; the variables behind are exact.
void Disturb(int probe, std::size_t site, const Vector& size, Vector* x) {
  x->head(size.size()) += Signed(probe, site, size);
}

using Probes = std::array<Vector, kProbes>;

Vector RootMeanSquare(const Probes& probes) {
  Vector sum = Vector::Zero(probes[0].size());
  for (const Vector& probe : probes) sum += probe.cwiseAbs2();
  return (sum / kProbes).cwiseSqrt();
}

/// The part of a transition's speeds of approach that errors e [2d] of the state leave unknown.
double RelativeRateError(const MechanicalSystem& system, const Transition& transition,
                         const Vector& e) {
  const int d = system.dof(), nq = system.num_positions();
  const Vector q = transition.x_minus.head(nq), v = transition.x_minus.tail(d);
  ConstraintTerms terms;
  system.Constraints(q, v, &terms);
  ResidualJacobian residual;
  system.DifferentiateImpact(q, Vector::Zero(d), Vector::Zero(terms.gap.size()), v, &residual);
  double largest = 0;
  for (int i : transition.activated | transition.switched) {
    const double speed = std::abs(terms.jacobian.row(i).dot(v));
    const double error = terms.jacobian.row(i).cwiseAbs().dot(e.segment(d, d)) +
                         residual.constraint_q.row(i).cwiseAbs().dot(e.head(d));
    largest = std::max(largest, error / speed);
  }
  return largest;
}

/// How far an arc's propagator is off, relatively, where the state is off by e [2d].
double PropagatorChange(ContactDynamics* dynamics, const Arc& arc, const Vector& e) {
  const double moved = (arc.x_end - arc.x_begin).cwiseAbs().maxCoeff();
  if (!(moved > 0)) return 0;
  dynamics->Differentiate(arc.x_begin, arc.mode);
  Matrix change = dynamics->acceleration_jacobian();
  dynamics->Differentiate(arc.x_end, arc.mode);
  change -= dynamics->acceleration_jacobian();
  return change.cwiseAbs().maxCoeff() / moved * e.cwiseAbs().maxCoeff() *
         (arc.t_end - arc.t_begin);
}

/// Errors of the factors, carried to the end, along a tangent at the beginning of the first arc.
Vector ErrorFrom(const BDerivative& derivative, Vector tangent) {
  const Eigen::Index d2 = derivative.time.size(), size = tangent.size();
  const std::vector<double>& parts = derivative.part_errors;
  Probes errors;
  errors.fill(Vector::Zero(size));
  for (std::size_t k = 0; k < derivative.arcs.size(); ++k) {
    const Matrix& Phi = derivative.arcs[k];
    const double own = parts[2 * k] * Phi.cwiseAbs().maxCoeff() * tangent.norm();
    tangent = Phi * tangent;
    for (int j = 0; j < kProbes; ++j) {
      errors[j] = Phi * errors[j];
      Disturb(j, 4 * k + 2, Vector::Constant(d2, own), &errors[j]);
    }
    if (k + 1 == derivative.arcs.size()) break;
    const Matrix reset = derivative.events[k].AnySelection();
    const Vector after = reset * tangent;
    const Vector jump = parts[2 * k + 1] * (after - tangent).head(d2).cwiseAbs();
    for (int j = 0; j < kProbes; ++j) {
      errors[j] = reset * errors[j];
      Disturb(j, 4 * k + 3, jump, &errors[j]);
    }
    tangent = after;
  }
  return kDerivativeSafety * RootMeanSquare(errors).head(d2);
}

}  // namespace

void EstimateErrors(const Trajectory& trajectory, std::size_t first,
                    const std::vector<std::shared_ptr<ContactDynamics>>& dynamics,
                    const std::vector<double>& propagator_errors, BDerivative* derivative) {
  const MechanicalSystem& system = dynamics.front()->system();
  const int tangents = 2 * system.dof();
  const Eigen::Index size = derivative->arcs.front().rows();
  Probes probes;
  probes.fill(Vector::Zero(size));
  derivative->part_errors.clear();
  for (std::size_t k = 0; k < derivative->arcs.size(); ++k) {
    AskBudget();
    const Arc& arc = trajectory.arcs[first + k];
    for (int j = 0; j < kProbes; ++j) {
      Disturb(j, 4 * k, arc.error, &probes[j]);
      probes[j] = derivative->arcs[k] * probes[j];
      Disturb(j, 4 * k + 1, arc.error, &probes[j]);
    }
    const Vector e = RootMeanSquare(probes);
    derivative->part_errors.push_back(
        propagator_errors[k] + PropagatorChange(dynamics[k].get(), arc, e.head(tangents)));
    if (k + 1 == derivative->arcs.size()) break;
    derivative->part_errors.push_back(
        RelativeRateError(system, trajectory.transitions[first + k], e.head(tangents)));
    const Matrix reset = derivative->events[k].AnySelection();
    for (Vector& probe : probes) probe = reset * probe;
  }
  derivative->trust.state_error = kStateSafety * RootMeanSquare(probes).head(tangents);
  double squared = 0;
  for (int j = 0; j < kProbes; ++j) {
    const Vector w = Signed(j, 2, Vector::Ones(size));
    squared += ErrorFrom(*derivative, w).cwiseAbs2().maxCoeff() / static_cast<double>(size);
  }
  derivative->trust.derivative_error = std::sqrt(squared / kProbes);
}

Vector BDerivative::Error(const VectorRef& w) const {
  return ErrorFrom(*this, start(Complete(w)));
}

}  // namespace contact_flow
