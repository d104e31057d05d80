// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/rolling_derivative.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "contact_flow/derivative/event_map.h"
#include "contact_flow/derivative/start_cone.h"
#include "contact_flow/derivative/variation.h"
#include "end_event.h"
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
      simultaneity_tolerance_(run.simultaneity_tolerance),
      directions_(directions),
      mark_(flow->now()),
      node_(mark_),
      tangents_(directions) {
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

Matrix RollingDerivative::Propagated(const Arc& motion, double end) {
  if (!(end > node_) || motion.dense.Empty()) return tangents_;
  Arc slice;
  slice.mode = motion.mode;
  slice.u = motion.u;
  slice.dense = motion.dense.Between(node_, end);
  slice.t_begin = node_;
  slice.t_end = end;
  slice.x_begin = slice.x_end = motion.x_begin;
  slice.dense.Evaluate(node_, slice.x_begin.data());
  slice.dense.Evaluate(end, slice.x_end.data());
  return PropagateArc(DynamicsAt(motion.u), slice, options_.tolerance) * tangents_;
}

void RollingDerivative::Follow(OnlineFlow* flow, bool passed) {
  if (status_.ok()) {
    try {
      const Arc motion = flow->Motion();
      DynamicsAt(motion.u);
      while (node_ < motion.t_end && !motion.dense.Empty()) {
        const double end = passed ? std::min(SliceEnd(), motion.t_end) : SliceEnd();
        if (end > motion.t_end) break;
        tangents_ = Propagated(motion, end);
        node_ = end;
      }
      if (passed) {
        Pass(*flow);
        if (status_.ok()) node_ = flow->now();
      }
    } catch (const std::domain_error& error) {
      status_ = {Outcome::kNotDifferentiable, error.what()};
    }
  }
  flow->Forget(status_.ok() ? node_ : flow->now());
}

RollingDerivative::Reading RollingDerivative::Read(OnlineFlow* flow) {
  Reading reading{node_, tangents_, {}, status_};
  if (status_.ok()) {
    try {
      reading.tangents = Propagated(flow->Motion(), flow->now());
      reading.t = flow->now();
      reading.status = CheckNow(flow, mark_, cluster_, options_.variables, reading.tangents);
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
  if (cluster_.empty() || !AreClose(cluster_.back(), transition, simultaneity_tolerance_)) {
    cluster_.clear();
    cluster_inputs_.clear();
    before_cluster_ = tangents_;
    cluster_dynamics_ = dynamics_;
  }
  cluster_.push_back(transition);
  if (transition.changes_input) {
    cluster_inputs_.push_back(
        std::make_shared<ContactDynamics>(system_, flow.NextInput(), options_.variables));
  }
  if (!cluster_inputs_.empty() && cluster_inputs_.size() < cluster_.size()) {
    std::vector<const Transition*> parts;
    for (const Transition& part : cluster_) parts.push_back(&part);
    const Vector &before = cluster_dynamics_->u(), &after = cluster_inputs_.back()->u();
    if (AreIndependent(system_, parts, before, after)) return Pass(EventMap(dynamics_, transition));
    const InputCluster whole = UniteWithInput(system_, parts);
    status_ = whole.status;
    if (!status_.ok()) return;
    tangents_ = before_cluster_;
    return Pass(EventMap(cluster_dynamics_, whole.transition, cluster_inputs_));
  }
  Pass(EventMap(dynamics_, transition));
}

void RollingDerivative::Pass(const EventMap& event) {
  status_ = event.status();
  if (status_.ok()) status_ = CheckTouching(dynamics_.get(), event.transition(), tangents_);
  if (!status_.ok()) return;
  for (int j = 0; j < tangents_.cols(); ++j) tangents_.col(j) = event(tangents_.col(j));
}

}  // namespace contact_flow
