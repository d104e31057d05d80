// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/b_derivative.h"

#include <algorithm>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>

#include "contact_flow/budget.h"
#include "contact_flow/derivative/start_directions.h"
#include "contact_flow/derivative/variation.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "error_estimate.h"
#include "event_laws.h"
#include "free_slips.h"
#include "input_cluster.h"
#include "run_law.h"
#include "touching_contacts.h"

namespace contact_flow {

Status CheckTransition(const Transition& transition) {
  if (transition.completes_zeno) {
    std::ostringstream message;
    message << "infinitely many bounces were completed to sticking at t = " << transition.t
            << " s: the outcome has no derivative by Theorem 1 (Def. 2 fails)";
    return {Outcome::kZeno, message.str()};
  }
  return transition.obstacle;
}

namespace {

/// The first transition before arc `last` at which the outcome is discontinuous; the maps up to it.
Status FirstJump(const Trajectory& trajectory,
                 const std::vector<std::shared_ptr<ContactDynamics>>& dynamics, std::size_t last,
                 std::vector<EventMap>* events) {
  try {
    for (std::size_t k = 0; k < last; ++k) {
      const Transition& transition = trajectory.transitions[k];
      if (transition.completes_zeno || !transition.obstacle.ok()) break;
      events->emplace_back(dynamics[k], transition);
      const Status& status = events->back().status();
      if (status.outcome == Outcome::kDiscontinuous) return status;
      if (!status.ok()) break;
    }
  } catch (const std::domain_error&) {  // then there is no such map
  }
  return {};
}

/// Contacts that touch without force are to touch in every perturbed run.
Status CheckTouchingContacts(const Trajectory& trajectory, std::size_t first,
                             const std::vector<std::shared_ptr<ContactDynamics>>& dynamics,
                             const BDerivative& derivative) {
  for (std::size_t k = 0; k < derivative.events.size(); ++k) {
    const Transition& transition = derivative.events[k].transition();
    if (transition.touching.Empty() || derivative.events[k].absorbed()) continue;
    Matrix tangents = derivative.arcs[0];
    for (std::size_t j = 0; j < k; ++j) {
      tangents = derivative.arcs[j + 1] * derivative.events[j].AnySelection() * tangents;
    }
    const Status status = CheckTouching(dynamics[first + k].get(), transition, tangents);
    if (!status.ok()) return status;
  }
  return {};
}

}  // namespace

/// w with (δu, δp) = 0 where they are left out.
Vector BDerivative::Complete(const VectorRef& w) const {
  if (!status.ok()) throw std::domain_error("there is no derivative: " + status.message);
  const Eigen::Index size = arcs.front().cols(), tangents = time.size();
  if (w.size() != size && w.size() != tangents) {
    throw std::invalid_argument("the direction has " + std::to_string(w.size()) +
                                " entries: " + std::to_string(tangents) + " (δq, δv) or " +
                                std::to_string(size) + " (δq, δv, δu, δp) are needed");
  }
  Vector complete = Vector::Zero(size);
  complete.head(w.size()) = w;
  return complete;
}

Vector BDerivative::First(const VectorRef& w) const {
  return arcs.front() * start_stop(start(Complete(w)));
}

Vector BDerivative::operator()(const VectorRef& w) const {
  const BudgetStage stage("the derivative along a direction");
  Vector tangent = First(w);
  for (std::size_t k = 0; k < events.size(); ++k) tangent = arcs[k + 1] * events[k](tangent);
  return tangent.head(time.size());
}

Vector BDerivative::operator()(double dt, const VectorRef& w) const {
  return dt * time + (*this)(w);
}

std::vector<ContactMode> BDerivative::PerturbedModes(const VectorRef& w) const {
  std::vector<ContactMode> modes = {initial_mode};
  Vector tangent = First(w);
  for (std::size_t k = 0; k < events.size(); ++k) {
    const std::vector<ContactMode> passed = events[k].PerturbedModes(tangent);
    modes.insert(modes.end(), passed.begin(), passed.end());
    tangent = arcs[k + 1] * events[k](tangent);
  }
  return modes;
}

bool BDerivative::IsDifferentiable() const {
  if (!status.ok() || !start.Empty() || !start_stop.PiecewiseLinear().ok()) return false;
  for (const EventMap& event : events) {
    if (!event.IsDifferentiable(options.kink_tolerance)) return false;
  }
  return true;
}

Status BDerivative::PiecewiseLinear() const {
  if (!status.ok()) return status;
  if (!start.PiecewiseLinear().ok()) return start.PiecewiseLinear();
  if (const Status stops = start_stop.PiecewiseLinear(); !stops.ok()) return stops;
  for (const EventMap& event : events) {
    if (!event.PiecewiseLinear().ok()) return event.PiecewiseLinear();
  }
  return {};
}

PiecewiseLinearMap BDerivative::Pieces() const {
  if (!start.PiecewiseLinear().ok()) throw NotPiecewiseLinear(start.PiecewiseLinear().message);
  if (const Status stops = start_stop.PiecewiseLinear(); !stops.ok()) {
    throw NotPiecewiseLinear(stops.message);
  }
  BudgetStage stage("the pieces, event by event", events.size());
  PiecewiseLinearMap map = PiecewiseLinearMap::Linear(
      start_stop.Empty() ? arcs.front() : Matrix(arcs.front() * start_stop.matrix()));
  if (!start.Empty()) {
    LinearPiece piece = map.pieces().front();
    piece.cone = start.Cone();
    map = PiecewiseLinearMap({piece});
  }
  for (std::size_t k = 0; k < events.size(); ++k) {
    map = events[k].Pieces(options.max_activations_for_pieces).After(map, options.max_pieces);
    map = PiecewiseLinearMap::Linear(arcs[k + 1]).After(map, options.max_pieces);
    stage.Next();
  }
  if (map.rows() == time.size()) return map;
  return PiecewiseLinearMap::Linear(Matrix::Identity(time.size(), map.rows()))
      .After(map, options.max_pieces);
}

void BDerivative::CarryNeglected() {
  const Eigen::Index d = time.size() / 2;
  neglected_jump = Vector::Zero(2 * d);
  neglected_derivative = 0;
  for (std::size_t k = 0; k < events.size(); ++k) {
    const ClusterReport& cluster = events[k].cluster();
    const bool nothing = cluster.neglected_jump.size() == 0 || cluster.neglected_jump.isZero(0);
    if (nothing && cluster.neglected_derivative == 0) continue;
    // What comes before and after, along one selection of each other event.
    Matrix before = arcs[0], after = arcs[k + 1];
    AskBudget();
    for (std::size_t j = 0; j < k; ++j) before = arcs[j + 1] * events[j].AnySelection() * before;
    for (std::size_t j = k + 1; j < events.size(); ++j) {
      after = arcs[j + 1] * events[j].AnySelection() * after;
    }
    const Matrix effect = after.topRows(2 * d).cwiseAbs();
    if (!nothing) neglected_jump += effect.middleCols(d, d) * cluster.neglected_jump;
    // |L D R| ≤ ‖L‖_∞ max|D| ‖R‖_1, entry by entry.
    neglected_derivative += effect.middleCols(d, d).rowwise().sum().maxCoeff() *
                            cluster.neglected_derivative *
                            before.cwiseAbs().colwise().sum().maxCoeff();
  }
}

namespace {

/// A force that is known all along an arc to less than this part of the absolute tolerance
/// may be anything.
constexpr double kIdle = 1e-3;

/// Not kOk where a contact holds without a force that would keep it: it may as well let go.
Status CheckPushes(const MechanicalSystem& system, const Arc& arc,
                   const VariationStatistics& statistics, double absolute_tolerance) {
  if (arc.t_end == arc.t_begin) return {};
  for (int i : arc.mode - system.compliant()) {
    if (statistics.push_reach(i) > kIdle * absolute_tolerance) continue;
    std::ostringstream message;
    message.precision(12);
    message << "from t = " << arc.t_begin << " s to " << arc.t_end << " s the contact '"
            << system.description().constraints[i]
            << "' holds without a force: whether it does in a perturbed run is decided by nothing "
               "that is known here";
    return {Outcome::kNotDifferentiable, message.str()};
  }
  return {};
}

/// Not kOk where a face slides in space: how its forces are shared is not unique, and it decides as
/// soon as the face turns.
Status CheckSlidingFace(ContactDynamics* dynamics, const Arc& arc) {
  dynamics->Evaluate(arc.x_begin, arc.mode);
  const MechanicalSystem& system = dynamics->system();
  for (int i : dynamics->shared()) {
    const Friction& friction = system.friction()[i];
    const bool turns = friction.dimension == 2 && friction.coefficient > 0;
    if (!turns || arc.mode.LetterOf(i) != Letter::kSlip) continue;
    return {Outcome::kNotDifferentiable,
            "from t = " + std::to_string(arc.t_begin) + " s on the contacts " +
                dynamics->shared().ToString(system.description().constraints) +
                " slide without turning and share their forces: a run that turns is not unique"};
  }
  return {};
}

}  // namespace

BDerivative DifferentiateOutcome(const MechanicalSystem& system, const Trajectory& trajectory,
                                 const BDerivativeOptions& options) {
  return DifferentiateArcs(system, trajectory, 0, trajectory.arcs.size() - 1, options);
}

BDerivative DifferentiateArcs(const MechanicalSystem& system, const Trajectory& trajectory,
                              std::size_t first, std::size_t last,
                              const BDerivativeOptions& options) {
  BDerivative derivative;
  derivative.options = options;
  derivative.status = trajectory.status;
  derivative.initial_mode = trajectory.arcs[first].mode;
  if (!derivative.status.ok()) return derivative;
  const std::vector<Arc>& arcs = trajectory.arcs;
  // One for each input: the event maps keep theirs.
  std::vector<std::shared_ptr<ContactDynamics>> dynamics(last + 1);
  for (std::size_t k = first; k <= last; ++k) {
    const bool same = k > first && arcs[k].u == arcs[k - 1].u;
    dynamics[k] = same ? dynamics[k - 1]
                       : std::make_shared<ContactDynamics>(system, arcs[k].u, options.variables);
  }
  if (first == 0) {  // a later beginning is reached by what came before it
    derivative.start =
        StartCone(dynamics[0].get(), arcs[0].x_begin, arcs[0].mode, arcs[0].t_begin,
                  trajectory.gap_tolerance, trajectory.speed_tolerance);
    // A run that is not even continuous in x says so first.
    derivative.status = derivative.start.status();
    if (!derivative.status.ok()) {
      const Status jump = FirstJump(trajectory, dynamics, last, &derivative.events);
      if (!jump.ok()) derivative.status = jump;
      return derivative;
    }
  }
  derivative.start_stop = StartStop(dynamics[first], arcs[first].x_begin, arcs[first].mode);
  derivative.events.reserve(last - first);
  const InputClusters clusters(system, trajectory);
  std::vector<EventResidual> residuals(last - first);
  try {
    BudgetStage stage("the maps of the events", last - first);
    for (std::size_t k = first; k < last; ++k, stage.Next()) {
      const InputCluster* cluster = clusters.At(k);
      const Transition& transition =
          cluster != nullptr ? cluster->transition : trajectory.transitions[k];
      derivative.status = CheckTransition(transition);
      if (cluster != nullptr && derivative.status.ok()) derivative.status = cluster->status;
      if (!derivative.status.ok()) return derivative;
      AskBudget();
      residuals[k - first].value = Vector::Zero(2 * system.dof() + dynamics[k]->num_variables());
      if (cluster != nullptr) {
        derivative.events.push_back(clusters.Map(*cluster, options.variables));
        if (k > cluster->first) {
          derivative.events.back() = derivative.events.back().AbsorbedRest();
          continue;
        }
      } else {
        derivative.events.emplace_back(dynamics[k], transition);
      }
      derivative.status = derivative.events.back().status();
      if (!derivative.status.ok()) return derivative;
      ContactDynamics* after = dynamics[std::min(k + 1, last)].get();
      std::unique_ptr<ContactDynamics> behind;  // the cluster
      if (cluster != nullptr) {
        behind = std::make_unique<ContactDynamics>(system, arcs[cluster->last + 1].u,
                                                   options.variables);
        after = behind.get();
      }
      derivative.status =
          CheckEventLaws(dynamics[k].get(), after, transition, derivative.events.back(),
                         &derivative.trust, &residuals[k - first]);
      if (!derivative.status.ok()) return derivative;
    }
    std::vector<double> errors;
    BudgetStage propagation("the tangents of the arcs", last - first + 1);
    for (std::size_t k = first; k <= last; ++k, propagation.Next()) {
      if (clusters.Around(k) != nullptr) {
        const Eigen::Index size = 2 * system.dof() + dynamics[k]->num_variables();
        derivative.arcs.push_back(Matrix::Identity(size, size));
        errors.push_back(0);
        continue;
      }
      derivative.status = CheckFreeSlips(*dynamics[k], arcs[k]);
      if (!derivative.status.ok()) return derivative;
      VariationStatistics statistics;
      derivative.arcs.push_back(
          PropagateArc(dynamics[k].get(), arcs[k], options.tolerance, &statistics));
      derivative.status = CheckSlidingFace(dynamics[k].get(), arcs[k]);
      if (!derivative.status.ok()) return derivative;
      derivative.status = CheckPushes(system, arcs[k], statistics, trajectory.absolute_tolerance);
      if (!derivative.status.ok()) return derivative;
      errors.push_back(statistics.error_estimate);
      derivative.trust.flow_law =
          std::max(derivative.trust.flow_law, statistics.flow_law_residual);
    }
    derivative.status = CheckTouchingContacts(trajectory, first, dynamics, derivative);
    if (!derivative.status.ok()) return derivative;
    derivative.time = clusters.EndField(dynamics[last].get(), last).head(2 * system.dof());
    derivative.status = CheckRunLaw(trajectory, first, residuals, &derivative);
    if (!derivative.status.ok()) return derivative;
    derivative.CarryNeglected();
    dynamics.erase(dynamics.begin(), dynamics.begin() + static_cast<std::ptrdiff_t>(first));
    EstimateErrors(trajectory, first, dynamics, errors, &derivative);
  } catch (const std::domain_error& reason) {
    derivative.status = {Outcome::kNotDifferentiable, reason.what()};
  } catch (const BudgetExceeded& reason) {
    derivative.status = {OutcomeOf(reason), reason.what()};
  }
  return derivative;
}

Vector ProjectAdmissible(const MechanicalSystem& system, const VectorRef& x, ContactMode mode,
                         const VectorRef& w, const Variables& variables) {
  // Entries (δu, δp) that are left out are zero.
  const bool whole = w.size() > 2 * system.dof();
  return StartDirections(system, x, mode, StartCone(), whole ? variables : Variables()).Project(w);
}

}  // namespace contact_flow
