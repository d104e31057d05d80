// SPDX-License-Identifier: BSD-3-Clause
#include "run_preparation.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "contact_flow/budget.h"
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

}  // namespace

RunPreparation::RunPreparation(const MechanicalSystem& system, const Trajectory& trajectory,
                               std::size_t first, std::size_t last, const Variables& variables,
                               InputCones cones)
    : system_(system),
      run_(trajectory),
      first_(first),
      last_(last),
      variables_(variables),
      cones_(std::move(cones)),
      clusters_(system, trajectory),
      dynamics_(last + 1),
      residuals_(last - first) {
  const std::size_t inputs = 1 + static_cast<std::size_t>(std::count_if(
                                     run_.transitions.begin(), run_.transitions.end(),
                                     [](const Transition& event) { return event.changes_input; }));
  if (!cones_.empty() && cones_.size() < inputs) {
    throw std::invalid_argument("cones of " + std::to_string(cones_.size()) +
                                " inputs, for a run that meets " + std::to_string(inputs));
  }
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

ArcInRun RunPreparation::InRun(std::size_t k) const {
  ArcInRun in_run;
  in_run.gap_tolerance = run_.gap_tolerance;
  in_run.speed_tolerance = run_.speed_tolerance;
  in_run.absolute_tolerance = run_.absolute_tolerance;
  in_run.duration = run_.t_end() - run_.t_begin();
  in_run.instant = kInstantPart * (run_.arcs[k].t_end - run_.arcs[k].t_begin);
  in_run.forces_decide = k < run_.transitions.size() && ForcesDecide(system_, run_.transitions[k]);
  if (cones_.empty()) return in_run;
  std::size_t interval = 0;
  for (std::size_t j = 0; j < k; ++j) interval += run_.transitions[j].changes_input ? 1 : 0;
  in_run.inputs = cones_[interval];
  return in_run;
}

Status RunPreparation::CheckBefore(std::size_t k) const {
  return CheckArc(dynamics_[k].get(), run_.arcs[k], InRun(k));
}

Status RunPreparation::CheckAfter(std::size_t k, const VariationStatistics& statistics) {
  const Status status = CheckSlidingFace(dynamics_[k].get(), run_.arcs[k], run_.gap_tolerance);
  if (!status.ok()) return status;
  return CheckPushes(system_, run_.arcs[k], statistics.push_reach, run_.absolute_tolerance);
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
