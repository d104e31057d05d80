// SPDX-License-Identifier: BSD-3-Clause
#include "run_preparation.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "contact_flow/budget.h"
#include "free_slips.h"
#include "idle_contacts.h"
#include "resting_corners.h"
#include "run_law.h"
#include "src/dynamics/implied_contacts.h"
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

/// Contacts of a face beside those that carry it while it slides in space: they could as well.
ConstraintSet IdleCorners(const MechanicalSystem& system, const Arc& arc, double gap_tolerance) {
  const auto turns = [&](int i) {
    return system.friction()[i].dimension == 2 && system.friction()[i].coefficient > 0;
  };
  bool slides = false;
  for (int i : arc.mode) slides = slides || (turns(i) && arc.mode.LetterOf(i) == Letter::kSlip);
  if (!slides) return {};
  ConstraintTerms terms;
  system.Constraints(arc.x_begin.head(system.num_positions()), arc.x_begin.tail(system.dof()),
                     &terms);
  ConstraintSet near;
  for (int i = 0; i < system.num_constraints(); ++i) {
    const bool beside = !arc.mode.Contains(i) && !system.compliant().Contains(i) && turns(i);
    if (beside && std::abs(terms.gap(i)) <= gap_tolerance) near.Insert(i);
  }
  return near.Empty() ? near : ImpliedClosed(system, arc.x_begin, arc.mode, near);
}

/// Not kOk where a face slides in space: how its forces are shared is not unique, and it decides as
/// soon as the face turns.
Status CheckSlidingFace(ContactDynamics* dynamics, const Arc& arc, double gap_tolerance) {
  const MechanicalSystem& system = dynamics->system();
  if (!system.HasFriction()) return {};
  dynamics->Evaluate(arc.x_begin, arc.mode);
  const std::string from = "from t = " + std::to_string(arc.t_begin) + " s on the contacts ";
  const ConstraintSet idle = IdleCorners(system, arc, gap_tolerance);
  if (!dynamics->springs().Empty() || !idle.Empty()) {
    const ConstraintSet face = idle.Empty() ? dynamics->springs() : arc.mode | idle;
    return {Outcome::kIndeterminateForces,
            from + face.ToString(system.description().constraints) +
                " share forces that decide the motion: another share is as possible"};
  }
  for (int i : dynamics->shared()) {
    const Friction& friction = system.friction()[i];
    const bool turns = friction.dimension == 2 && friction.coefficient > 0;
    if (!turns || arc.mode.LetterOf(i) != Letter::kSlip) continue;
    return {Outcome::kNotDifferentiable,
            from + dynamics->shared().ToString(system.description().constraints) +
                " slide without turning and share their forces: a run that turns is not unique"};
  }
  return {};
}

}  // namespace

RunPreparation::RunPreparation(const MechanicalSystem& system, const Trajectory& trajectory,
                               std::size_t first, std::size_t last, const Variables& variables)
    : system_(system),
      run_(trajectory),
      first_(first),
      last_(last),
      variables_(variables),
      clusters_(system, trajectory),
      dynamics_(last + 1),
      residuals_(last - first) {
  // One for each input: the event maps keep theirs.
  const std::vector<Arc>& arcs = run_.arcs;
  for (std::size_t k = first; k <= last; ++k) {
    const bool same = k > first && arcs[k].u == arcs[k - 1].u;
    dynamics_[k] =
        same ? dynamics_[k - 1] : std::make_shared<ContactDynamics>(system, arcs[k].u, variables);
  }
}

bool RunPreparation::Begin(BDerivative* derivative) {
  const Arc& arc = run_.arcs[first_];
  derivative->status = run_.status;
  derivative->initial_mode = arc.mode;
  if (!run_.status.ok()) return false;
  if (first_ == 0) {  // a later beginning is reached by what came before it
    derivative->start = StartCone(dynamics_[0].get(), arc.x_begin, arc.mode, arc.t_begin,
                                  run_.gap_tolerance, run_.speed_tolerance, run_.impact_law);
    // A run that is not even continuous in x says so first.
    derivative->status = derivative->start.status();
    if (!derivative->status.ok()) {
      const Status jump = FirstJump(run_, dynamics_, last_, &derivative->events);
      if (!jump.ok()) derivative->status = jump;
      return false;
    }
  }
  if (clusters_.Around(first_) != nullptr) return true;  // what begins there is the cluster's
  derivative->start_stop = StartStop(dynamics_[first_], arc.x_begin, arc.mode);
  return true;
}

bool RunPreparation::MakeEvents(BDerivative* derivative) {
  Status& status = derivative->status;
  derivative->events.reserve(last_ - first_);
  BudgetStage stage("the maps of the events", last_ - first_);
  for (std::size_t k = first_; k < last_; ++k, stage.Next()) {
    const InputCluster* cluster = clusters_.At(k);
    const Transition& transition = cluster != nullptr ? cluster->transition : run_.transitions[k];
    status = CheckTransition(transition);
    if (cluster != nullptr && status.ok()) status = cluster->status;
    if (!status.ok()) return false;
    AskBudget();
    residuals_[k - first_].value = Vector::Zero(size());
    if (cluster != nullptr) {
      derivative->events.push_back(clusters_.Map(*cluster, variables_));
      if (k > cluster->first) {
        derivative->events.back() = derivative->events.back().AbsorbedRest();
        continue;
      }
    } else {
      derivative->events.emplace_back(dynamics_[k], transition);
    }
    status = derivative->events.back().status();
    if (!status.ok()) return false;
    ContactDynamics* after = dynamics_[std::min(k + 1, last_)].get();
    std::unique_ptr<ContactDynamics> behind;  // the cluster
    if (cluster != nullptr) {
      behind =
          std::make_unique<ContactDynamics>(system_, run_.arcs[cluster->last + 1].u, variables_);
      after = behind.get();
    }
    status = CheckEventLaws(dynamics_[k].get(), after, transition, derivative->events.back(),
                            &derivative->trust, &residuals_[k - first_]);
    if (!status.ok()) return false;
  }
  return true;
}

Status RunPreparation::CheckBefore(std::size_t k) const {
  Status status = CheckFreeSlips(*dynamics_[k], run_.arcs[k]);
  if (status.ok()) status = CheckRestingCorners(*dynamics_[k], run_.arcs[k]);
  if (!status.ok()) return status;
  return CheckIdleContacts(dynamics_[k].get(), run_, k);
}

Status RunPreparation::CheckAfter(std::size_t k, const VariationStatistics& statistics) {
  const Status status = CheckSlidingFace(dynamics_[k].get(), run_.arcs[k], run_.gap_tolerance);
  if (!status.ok()) return status;
  return CheckPushes(system_, run_.arcs[k], statistics, run_.absolute_tolerance);
}

Status RunPreparation::CheckTouchingContacts(const BDerivative& derivative,
                                             const ArcProduct& carry) {
  for (std::size_t k = 0; k < derivative.events.size(); ++k) {
    const Transition& transition = derivative.events[k].transition();
    if (transition.touching.Empty() || derivative.events[k].absorbed()) continue;
    Matrix tangents = Matrix::Identity(size(), size());
    carry(0, &tangents);
    for (std::size_t j = 0; j < k; ++j) {
      tangents = derivative.events[j].AnySelection() * tangents;
      carry(j + 1, &tangents);
    }
    const Status status = CheckTouching(dynamics_[first_ + k].get(), transition, tangents);
    if (!status.ok()) return status;
  }
  return {};
}

Status RunPreparation::CheckLaw(const ArcProduct& carry, BDerivative* derivative) const {
  return CheckRunLaw(run_, first_, residuals_, carry, derivative);
}

std::vector<std::shared_ptr<ContactDynamics>> RunPreparation::DynamicsOfArcs() const {
  return {dynamics_.begin() + static_cast<std::ptrdiff_t>(first_), dynamics_.end()};
}

Vector RunPreparation::EndField() const {
  return clusters_.EndField(dynamics_[last_].get(), last_).head(2 * system_.dof());
}

}  // namespace contact_flow
