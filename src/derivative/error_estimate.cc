// SPDX-License-Identifier: BSD-3-Clause
#include "error_estimate.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "event_order.h"
#include "propagator_change.h"
#include "reset_error.h"

namespace contact_flow {
namespace {

/// Transitions closer than this part of the run are asked for their order.
constexpr double kClose = 1e-3;
/// An error that is estimated as ε, relative, is about kOrder ε^{9/8}; of one step at least this.
constexpr double kOrder = 5, kUnitRounding = 4e-16;
/// … and of implicit steps, whose iteration leaves what has no order, this part.
constexpr double kIteration = 0.5;
/// Calibrated in error_calibration_test.cc of test/derivative and test/friction: true errors stay
/// below the estimates in 99 % of the runs. The first: of the state; the second: of propagators as
/// collocation estimates them, no better than a part of its tolerance where it is not exact.
constexpr double kStateSafety = 1.2, kPropagatorSafety = 6;
constexpr double kExact = 1e-13, kSharpest = 0.03;

/// Signs that repeat to the bit: of entry i in the place `site` for one probe.
double Sign(int probe, std::size_t site, Eigen::Index i) {
  std::uint64_t x =
      (static_cast<std::uint64_t>(probe) << 48) ^ (site << 24) ^ static_cast<std::uint64_t>(i + 1);
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
template <class Sizes>
void Disturb(int probe, std::size_t site, const Sizes& size, Vector* x) {
  for (Eigen::Index i = 0; i < size.size(); ++i) (*x)(i) += Sign(probe, site, i) * size(i);
}

/// x ← A x, by a buffer of its size.
void Carry(const Matrix& A, Vector* x, Vector* buffer) {
  buffer->noalias() = A * *x;
  *x = *buffer;
}

/// What is no number, an infinite error times zero, is not known: infinite.
Vector RootMeanSquare(const Probes& probes) {
  Vector sum = Vector::Zero(probes[0].size());
  for (const Vector& probe : probes) sum += probe.cwiseAbs2();
  for (double& entry : sum) {
    if (std::isnan(entry)) entry = std::numeric_limits<double>::infinity();
  }
  return (sum / kProbes).cwiseSqrt();
}

/// What the local errors of an arc add up to [2d]. The integrator goes on with an order more than
/// it estimates the error of: of an estimate ε, relative, kOrder ε^{1/8} is left, and rounding; of
/// implicit steps also what remains of their equations.
Vector ArcError(const Arc& arc) {
  const double scale = 1 + arc.x_end.cwiseAbs().maxCoeff();
  const auto steps = static_cast<double>(std::max<std::size_t>(1, arc.dense.NumSteps()));
  const double least = arc.implicit_steps > 0 ? kIteration : 0;
  Vector error = arc.error;
  for (double& e : error) {
    const double left = std::max(least, kOrder * std::pow(e / (steps * scale), 1.0 / 8));
    e = std::max(std::min(1.0, left) * e, std::min(e, steps * kUnitRounding * scale));
  }
  return error;
}

/// Of a propagator as it is computed, relative.
double PropagatorError(double estimated, double tolerance) {
  const double error = kPropagatorSafety * estimated;
  return estimated > kExact ? std::max(error, kSharpest * tolerance) : error;
}

/// A selection of each event.
std::vector<Matrix> Resets(const BDerivative& derivative) {
  std::vector<Matrix> resets;
  for (const EventMap& event : derivative.events) resets.push_back(event.AnySelection());
  return resets;
}

/// Errors of the factors, carried to the end, along a tangent at the beginning of the first arc.
Vector ErrorFrom(const BDerivative& derivative, const std::vector<Matrix>& resets, Vector tangent) {
  const Eigen::Index d2 = derivative.time.size(), size = tangent.size();
  const std::vector<double>& parts = derivative.part_errors;
  Probes errors;
  errors.fill(Vector::Zero(size));
  Vector buffer(size), after(size), own(d2);
  for (std::size_t k = 0; k < derivative.arcs.size(); ++k) {
    const Matrix& Phi = derivative.arcs[k];
    const Vector bend = derivative.part_bends[k] * tangent;
    // Entry by entry, which holds in any unit.
    own.noalias() = Phi.topRows(d2).cwiseAbs() * tangent.cwiseAbs();
    own *= PropagatorError(parts[2 * k], derivative.options.tolerance);
    Carry(Phi, &tangent, &buffer);
    for (int j = 0; j < kProbes; ++j) {
      Carry(Phi, &errors[j], &buffer);
      Disturb(j, 4 * k + 2, own, &errors[j]);
      errors[j].head(d2) += Sign(j, 4 * k + 1, -1) * bend;
    }
    if (k + 1 == derivative.arcs.size()) break;
    const Matrix& reset = resets[k];
    after.noalias() = reset * tangent;
    const Vector change = (after - tangent).head(d2), jump = parts[2 * k + 1] * change.cwiseAbs();
    const TurnedImpulses& turned = derivative.part_turns[k];
    const Vector across = turned.shares.size() > 0 ? turned.SizesOf(change.tail(d2 / 2)) : Vector();
    for (int j = 0; j < kProbes; ++j) {
      Carry(reset, &errors[j], &buffer);
      Disturb(j, 4 * k + 3, jump, &errors[j]);
      if (across.size() == 0) continue;
      errors[j].segment(d2 / 2, d2 / 2) += turned.across * Signed(j, 4 * k, across);
    }
    tangent.swap(after);
  }
  return RootMeanSquare(errors).head(d2);
}

/// Errors of the state on their way to T, as samples, and whether they leave the order of
/// events unknown.
class StateErrors {
 public:
  StateErrors(const Trajectory& trajectory, std::size_t first,
              const std::vector<std::shared_ptr<ContactDynamics>>& dynamics,
              const std::vector<EventMap>& events, Eigen::Index size)
      : trajectory_(trajectory), first_(first), dynamics_(dynamics), events_(events) {
    probes_.fill(Vector::Zero(size));
  }

  const Probes& probes() const { return probes_; }
  /// `carry` applies the propagator of arc k.
  template <class CarryArc>
  void PassArc(std::size_t k, const CarryArc& carry) {
    const Vector local = ArcError(trajectory_.arcs[first_ + k]);
    for (int j = 0; j < kProbes; ++j) Disturb(j, 4 * k, local, &probes_[j]);
    carry(&probes_);
    for (int j = 0; j < kProbes; ++j) Disturb(j, 4 * k + 1, local, &probes_[j]);
  }
  /// Not kOk where the order of this event and the one before is not known.
  Status PassEvent(std::size_t k, const Matrix& reset) {
    const Transition& transition = events_[k].transition();
    const double span = trajectory_.t_end() - trajectory_.t_begin();
    const MechanicalSystem& system = dynamics_[k]->system();
    const bool close = k + 1 < events_.size() &&
                       trajectory_.transitions[first_ + k + 1].t - transition.t < kClose * span;
    if (close || !last_shifts_.empty()) {
      std::vector<Vector*> errors;
      for (Vector& probe : probes_) errors.push_back(&probe);
      KeepContacts(system, transition, errors);
    }
    Status status;
    if (!last_shifts_.empty()) {
      status =
          CheckOrder(system, events_[before_].transition(), transition, last_shifts_, Shifts(k));
    }
    before_ = k;
    last_shifts_ = close ? Shifts(k) : std::vector<double>();
    Vector buffer(reset.rows());
    for (Vector& probe : probes_) Carry(reset, &probe, &buffer);
    AddUnresolved(transition, k);
    return status;
  }

 private:
  /// What events change of velocities that count as simultaneous, over the time between them; the
  /// speed that slips in space are given to begin with; and what bounces that are made rest may
  /// have changed: by turning slips, and while they would have lasted.
  void AddUnresolved(const Transition& transition, std::size_t k) {
    const MechanicalSystem& system = dynamics_[k]->system();
    const int d = system.dof(), nq = system.num_positions();
    Vector given = transition.begun.size() > 0 ? transition.begun : Vector(Vector::Zero(d));
    if (transition.turned > 0) {
      const InverseInertia inertia(system, transition.x_minus.head(nq), transition.x_plus.tail(d));
      const Vector push = inertia.terms().jacobian.transpose() * transition.rest_impulse;
      given += transition.turned * Vector(inertia * push).cwiseAbs();
    }
    const Vector& rest = transition.rest_error;
    const Vector early =
        transition.spread * (transition.x_plus.tail(d) - transition.x_minus.tail(d));
    for (int j = 0; j < kProbes; ++j) {
      probes_[j].head(d) += Sign(j, 4 * k + 3, -1) * early;
      const double sign = Sign(j, 4 * k + 2, -1);
      if (rest.size() > 0) probes_[j].head(2 * d) += sign * rest;
      probes_[j].segment(d, d) += sign * given;
    }
  }
  std::vector<double> Shifts(std::size_t k) const {
    const Eigen::RowVectorXd by = InstantGradient(dynamics_[k].get(), events_[k].transition());
    std::vector<double> all;
    for (const Vector& e : probes_) all.push_back(by.dot(e.head(by.size())));
    return all;
  }

  const Trajectory& trajectory_;
  const std::size_t first_;
  const std::vector<std::shared_ptr<ContactDynamics>>& dynamics_;
  const std::vector<EventMap>& events_;
  Probes probes_;
  std::vector<double> last_shifts_;  // of the transition before, where the next one is close
  std::size_t before_ = 0;           // that one
};

}  // namespace

void EstimateErrors(const Trajectory& trajectory, std::size_t first,
                    const std::vector<std::shared_ptr<ContactDynamics>>& dynamics,
                    const std::vector<PropagationErrors>& propagation, BDerivative* derivative) {
  const MechanicalSystem& system = dynamics.front()->system();
  const int tangents = 2 * system.dof();
  const Eigen::Index size = derivative->arcs.front().rows();
  StateErrors errors(trajectory, first, dynamics, derivative->events, size);
  Vector buffer(size);
  const std::vector<Matrix> resets = Resets(*derivative);
  derivative->part_errors.clear();
  derivative->part_bends.clear();
  derivative->part_turns.clear();
  for (std::size_t k = 0; k < derivative->arcs.size(); ++k) {
    AskBudget();
    const Arc& arc = trajectory.arcs[first + k];
    std::vector<ArcPart> parts = propagation[k].parts;
    if (parts.empty()) parts.push_back({arc.t_begin, arc.t_end, derivative->arcs[k]});
    std::vector<Vector> e;
    const auto note = [&] {
      e.push_back(Signed(0, 4 * k, RootMeanSquare(errors.probes()).head(tangents)));
    };
    errors.PassArc(k, [&](Probes* probes) {
      for (const ArcPart& part : parts) {
        for (Vector& probe : *probes) Carry(part.phi, &probe, &buffer);
        if (e.size() + 1 < parts.size()) note();
      }
    });
    note();
    derivative->part_errors.push_back(propagation[k].relative);
    Matrix bend = PropagatorChange(dynamics[k].get(), arc, parts, e);
    const Matrix& law = propagation[k].law;
    if (law.size() > 0) bend += kPropagatorSafety * law.topRows(tangents);
    derivative->part_bends.push_back(std::move(bend));
    if (k + 1 == derivative->arcs.size()) break;
    if (derivative->events[k].absorbed()) {  // one with that before
      derivative->part_errors.push_back(0);
      derivative->part_turns.emplace_back();
      continue;
    }
    const Transition& transition = derivative->events[k].transition();
    derivative->part_errors.push_back(
        RelativeResetError(dynamics[k].get(), arc, transition, errors.probes()));
    derivative->part_turns.push_back(FindTurnedImpulses(system, transition));
    const Status order = errors.PassEvent(k, resets[k]);
    if (!order.ok()) derivative->status = order;
  }
  derivative->trust.state_error = kStateSafety * RootMeanSquare(errors.probes()).head(tangents);
  // Along one direction with a part in all, |w| = 1.
  const Vector w = Signed(0, 2, Vector::Constant(size, 1 / std::sqrt(static_cast<double>(size))));
  derivative->trust.derivative_error = ErrorFrom(*derivative, resets, w).cwiseAbs().maxCoeff();
}

Status CheckOrders(const Trajectory& trajectory,
                   const std::vector<std::shared_ptr<ContactDynamics>>& dynamics,
                   const BDerivative& derivative, const ArcProduct& carry, Vector* state_error) {
  const MechanicalSystem& system = dynamics.front()->system();
  const int tangents = 2 * system.dof();
  const Eigen::Index size = tangents + dynamics.front()->num_variables();
  StateErrors errors(trajectory, 0, dynamics, derivative.events, size);
  Status status;
  Matrix columns(size, kProbes);
  for (std::size_t k = 0; k <= derivative.events.size(); ++k) {
    AskBudget();
    errors.PassArc(k, [&](Probes* probes) {
      for (int j = 0; j < kProbes; ++j) columns.col(j) = (*probes)[j];
      carry(k, &columns);
      for (int j = 0; j < kProbes; ++j) (*probes)[j] = columns.col(j);
    });
    if (k == derivative.events.size() || derivative.events[k].absorbed()) continue;
    const Status order = errors.PassEvent(k, derivative.events[k].AnySelection());
    if (!order.ok()) status = order;
  }
  *state_error = kStateSafety * RootMeanSquare(errors.probes()).head(tangents);
  return status;
}

Vector BDerivative::Error(const VectorRef& w) const {
  return ErrorFrom(*this, Resets(*this), Begin(w));
}

}  // namespace contact_flow
