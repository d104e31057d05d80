// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/rolling_derivative.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "arc_checks.h"
#include "contact_flow/derivative/event_map.h"
#include "contact_flow/derivative/held_together.h"
#include "contact_flow/derivative/start_cone.h"
#include "contact_flow/derivative/variation.h"
#include "end_event.h"
#include "event_laws.h"
#include "frictional_reset.h"
#include "input_cluster.h"
#include "touching_contacts.h"

namespace contact_flow {
namespace {

/// A clock is moved by more than this part of the tangents.
constexpr double kMoved = 1e-12;

/// Of now as the end of a run from `begin` on, whose last transitions are these.
Status CheckNow(OnlineFlow* flow, double begin, const std::vector<Transition>& last,
                const Variables& variables, const Matrix& tangents) {
  Trajectory run;
  run.transitions = last;
  run.arcs.emplace_back();
  Arc& arc = run.arcs.back();
  arc.mode = flow->mode();
  arc.u = flow->u();
  arc.t_begin = last.empty() ? begin : last.back().t;
  arc.t_end = flow->now();
  arc.x_begin = arc.x_end = flow->State();
  const MechanicalSystem& system = flow->system();
  const Vector exact = Vector::Zero(2 * system.dof());
  ConstraintSet switches;
  const Status status = CheckEnd(system, run, exact, &switches);
  for (int i : switches) {
    const Vector side = SideOfSwitch(system, run, variables, 0, i);
    const double moved = (side.transpose() * tangents).cwiseAbs().maxCoeff();
    if (moved > kMoved * tangents.cwiseAbs().maxCoeff()) return CheckEnd(system, run, exact);
  }
  return status;
}

}  // namespace

RollingDerivative::RollingDerivative(OnlineFlow* flow, const Matrix& directions,
                                     const BDerivativeOptions& options, const SimulateOptions& run)
    : system_(flow->system()),
      options_(options),
      run_(run),
      directions_(directions),
      mark_(flow->now()),
      node_(mark_),
      tangents_(directions),
      arc_begin_(mark_),
      push_reach_(Vector::Zero(system_.num_constraints())) {
  const int size = 2 * system_.dof() + options.variables.Size(system_);
  if (directions.rows() != size || directions.cols() < 1) {
    throw std::invalid_argument("the directions are " + std::to_string(directions.rows()) + " × " +
                                std::to_string(directions.cols()) + ": " + std::to_string(size) +
                                " rows and at least one column are needed");
  }
  if (!directions.allFinite()) throw std::invalid_argument("the directions are not finite");
  Start(flow, run);
  flow->KeepMotion(true);
  flow->Forget();
}

/// A mark where a contact touches but is not in the mode is a cluster of its own.
void RollingDerivative::Start(OnlineFlow* flow, const SimulateOptions& run) {
  const StartCone start(DynamicsAt(flow->NextInput()), flow->State(), flow->mode(), mark_,
                        run.gap_tolerance, run.speed_tolerance, run.impact_law);
  status_ = start.status();
  try {
    const StartStop stop(dynamics_, flow->State(), flow->mode());
    for (int j = 0; j < tangents_.cols() && status_.ok(); ++j) {
      const Vector begun = start(directions_.col(j));
      tangents_.col(j) = stop(begun, start.Brushed(begun));
    }
  } catch (const std::logic_error& reason) {  // it leaves the domain, or lifts another contact
    status_ = {Outcome::kNotDifferentiable, reason.what()};
  }
}

ContactDynamics* RollingDerivative::DynamicsAt(const Vector& u) {
  // Event maps keep theirs: another input makes another one.
  if (!dynamics_ || dynamics_->u() != u) {
    dynamics_ = std::make_shared<ContactDynamics>(system_, u, options_.variables);
  }
  return dynamics_.get();
}

double RollingDerivative::SliceEnd() const {
  const double n = std::floor(node_ * kSliceRate) + 1;
  const double end = n / kSliceRate;  // to the bit where k / rate is
  return end > node_ ? end : (n + 1) / kSliceRate;
}

Arc RollingDerivative::Slice(const Arc& motion, double end) const {
  Arc slice;
  slice.mode = motion.mode;
  slice.u = motion.u;
  slice.dense = motion.dense.Between(node_, end);
  slice.t_begin = node_;
  slice.t_end = end;
  slice.x_begin = slice.x_end = motion.x_begin;
  slice.dense.Evaluate(node_, slice.x_begin.data());
  slice.dense.Evaluate(end, slice.x_end.data());
  return slice;
}

Status RollingDerivative::CheckSlice(const Arc& slice, bool forces_decide) {
  ContactDynamics* dynamics = DynamicsAt(slice.u);
  ArcInRun in_run;
  in_run.gap_tolerance = run_.gap_tolerance;
  in_run.speed_tolerance = run_.speed_tolerance;
  in_run.absolute_tolerance = run_.absolute_tolerance;
  in_run.duration = slice.t_end - mark_;
  in_run.instant = kInstantPart * (slice.t_end - arc_begin_);
  in_run.forces_decide = forces_decide;
  const Status status = CheckArc(dynamics, slice, in_run);
  if (node_ == arc_begin_) face_ = CheckSlidingFace(dynamics, slice, run_.gap_tolerance);
  return status;
}

Matrix RollingDerivative::Propagated(const Arc& slice, Vector* push_reach) {
  VariationStatistics statistics;
  const Matrix phi = PropagateArc(DynamicsAt(slice.u), slice, options_.tolerance, &statistics);
  *push_reach = push_reach->cwiseMax(statistics.push_reach);
  const HeldTogether held(DynamicsAt(slice.u), slice, options_.tolerance, 1);
  for (Eigen::Index j = 0; j < tangents_.cols() && !held.Empty(); ++j)
    held.Require(tangents_.col(j));
  return phi * tangents_;
}

Status RollingDerivative::CheckHolds(const Arc& motion, const Vector& push_reach,
                                     double end) const {
  if (!face_.ok()) return face_;
  Arc arc = motion;
  arc.t_begin = arc_begin_;
  arc.t_end = end;
  return CheckPushes(system_, arc, push_reach, run_.absolute_tolerance);
}

void RollingDerivative::Follow(OnlineFlow* flow, bool passed) {
  if (status_.ok()) {
    try {
      const Arc motion = flow->Motion();
      DynamicsAt(motion.u);
      while (node_ < motion.t_end && !motion.dense.Empty()) {
        const double end = passed ? std::min(SliceEnd(), motion.t_end) : SliceEnd();
        if (end > motion.t_end) break;
        const Arc slice = Slice(motion, end);
        status_ = CheckSlice(slice, false);
        if (!status_.ok()) break;
        tangents_ = Propagated(slice, &push_reach_);
        node_ = end;
      }
      if (passed && status_.ok()) PassArc(*flow, motion);
    } catch (const std::domain_error& error) {
      status_ = {Outcome::kNotDifferentiable, error.what()};
    }
  }
  flow->Forget(status_.ok() ? node_ : flow->now());
}

void RollingDerivative::PassArc(const OnlineFlow& flow, const Arc& motion) {
  const Transition& transition = flow.transition();
  const bool inside = !cluster_.empty() && IsClose(transition) &&
                      (transition.changes_input || !cluster_inputs_.empty());
  if (!inside) status_ = CheckHolds(motion, push_reach_, motion.t_end);
  if (!inside && status_.ok() && !motion.dense.Empty() && ForcesDecide(system_, transition)) {
    Arc last = motion;
    const double step = last.dense.StepBegin(last.dense.NumSteps() - 1);
    last.t_begin = std::max(arc_begin_, step);
    last.dense = motion.dense.Between(last.t_begin, motion.t_end);
    last.dense.Evaluate(last.t_begin, last.x_begin.data());
    status_ = CheckSlice(last, true);
  }
  if (status_.ok()) Pass(flow);
  if (!status_.ok()) return;
  node_ = arc_begin_ = flow.now();
  push_reach_.setZero();
  face_ = {};
}

bool RollingDerivative::IsClose(const Transition& transition) const {
  return AreClose(cluster_.back(), transition, run_.simultaneity_tolerance);
}

RollingDerivative::Reading RollingDerivative::Read(OnlineFlow* flow) {
  Reading reading{node_, tangents_, {}, status_};
  if (status_.ok()) {
    try {
      const Arc motion = flow->Motion();
      Vector push_reach = push_reach_;
      if (flow->now() > node_ && !motion.dense.Empty()) {
        const Arc slice = Slice(motion, flow->now());
        reading.status = CheckSlice(slice, false);
        reading.tangents = Propagated(slice, &push_reach);
      }
      reading.t = flow->now();
      if (reading.status.ok() && flow->now() > arc_begin_) {
        reading.status = CheckHolds(motion, push_reach, flow->now());
      }
      if (reading.status.ok()) {
        reading.status = CheckNow(flow, mark_, cluster_, options_.variables, reading.tangents);
      }
    } catch (const std::domain_error& error) {
      reading.status = {Outcome::kNotDifferentiable, error.what()};
    }
  }
  reading.tangents.conservativeResize(2 * system_.dof(), Eigen::NoChange);
  ContactDynamics* dynamics = DynamicsAt(flow->NextInput());
  reading.time = dynamics->Field(flow->State(), flow->mode()).head(2 * system_.dof());
  return reading;
}

void RollingDerivative::Pass(const OnlineFlow& flow) {
  const Transition& transition = flow.transition();
  status_ = CheckTransition(transition);
  if (!status_.ok()) return;
  if (cluster_.empty() || !IsClose(transition)) {
    cluster_.clear();
    cluster_inputs_.clear();
    before_cluster_ = tangents_;
    cluster_dynamics_ = dynamics_;
  }
  cluster_.push_back(transition);
  std::shared_ptr<ContactDynamics> after = dynamics_;
  if (transition.changes_input) {
    after = std::make_shared<ContactDynamics>(system_, flow.NextInput(), options_.variables);
    cluster_inputs_.push_back(after);
  }
  if (!cluster_inputs_.empty() && cluster_inputs_.size() < cluster_.size()) {
    std::vector<const Transition*> parts;
    for (const Transition& part : cluster_) parts.push_back(&part);
    const Vector &u_before = cluster_dynamics_->u(), &u_after = cluster_inputs_.back()->u();
    if (AreIndependent(system_, parts, u_before, u_after)) {
      return Pass(EventMap(dynamics_, transition), dynamics_.get(), after.get());
    }
    const InputCluster whole = UniteWithInput(system_, parts);
    status_ = whole.status;
    if (!status_.ok()) return;
    tangents_ = before_cluster_;
    return Pass(EventMap(cluster_dynamics_, whole.transition, cluster_inputs_),
                cluster_dynamics_.get(), cluster_inputs_.back().get());
  }
  Pass(EventMap(dynamics_, transition), dynamics_.get(), after.get());
}

void RollingDerivative::Pass(const EventMap& event, ContactDynamics* before,
                             ContactDynamics* after) {
  status_ = event.status();
  Trust trust;
  EventResidual residual;
  if (status_.ok()) {
    status_ = CheckEventLaws(before, after, event.transition(), event, &trust, &residual);
  }
  if (status_.ok()) status_ = CheckTouching(dynamics_.get(), event.transition(), tangents_);
  if (!status_.ok()) return;
  for (int j = 0; j < tangents_.cols(); ++j) tangents_.col(j) = event(tangents_.col(j));
}

}  // namespace contact_flow
