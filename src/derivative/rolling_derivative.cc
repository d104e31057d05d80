// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/rolling_derivative.h"

#include <sstream>
#include <stdexcept>
#include <string>

#include "contact_flow/derivative/event_map.h"
#include "contact_flow/derivative/variation.h"

namespace contact_flow {

RollingDerivative::RollingDerivative(OnlineFlow* flow, const Matrix& directions,
                                     const BDerivativeOptions& options,
                                     double simultaneity_tolerance)
    : system_(flow->system()),
      options_(options),
      simultaneity_tolerance_(simultaneity_tolerance),
      directions_(directions),
      mark_(flow->now()),
      now_(mark_),
      tangents_(directions) {
  const int size = 2 * system_.dof() + options.variables.Size(system_);
  if (directions.rows() != size || directions.cols() < 1) {
    throw std::invalid_argument("the directions are " + std::to_string(directions.rows()) + " × " +
                                std::to_string(directions.cols()) + ": " + std::to_string(size) +
                                " rows and at least one column are needed");
  }
  if (!directions.allFinite()) throw std::invalid_argument("the directions are not finite");
  flow->KeepMotion(true);
  flow->Forget();
}

ContactDynamics* RollingDerivative::DynamicsAt(const Vector& u) {
  // Event maps keep theirs: another input makes another one.
  if (!dynamics_ || dynamics_->u() != u) {
    dynamics_ = std::make_shared<ContactDynamics>(system_, u, options_.variables);
  }
  return dynamics_.get();
}

void RollingDerivative::Follow(OnlineFlow* flow, bool passed) {
  if (status_.ok()) {
    try {
      Propagate(flow->Motion());
      if (passed) Pass(flow->transition());
      now_ = flow->now();
    } catch (const std::domain_error& error) {
      status_ = {Outcome::kNotDifferentiable, error.what()};
    }
  }
  flow->Forget();
}

void RollingDerivative::Propagate(Arc motion) {
  DynamicsAt(motion.u);
  if (!(motion.t_end > now_)) return;
  if (motion.t_begin < now_) {  // the part from here on
    motion.t_begin = now_;
    motion.dense.Evaluate(now_, motion.x_begin.data());
  }
  if (motion.t_begin == motion.t_end || motion.dense.Empty()) return;
  tangents_ = PropagateArc(dynamics_.get(), motion, options_.tolerance) * tangents_;
}

void RollingDerivative::Pass(const Transition& transition) {
  status_ = CheckTransition(last_ ? &*last_ : nullptr, transition, simultaneity_tolerance_);
  if (!status_.ok()) return;
  const EventMap event(dynamics_, transition);
  status_ = event.status();
  if (!status_.ok()) return;
  for (int j = 0; j < tangents_.cols(); ++j) tangents_.col(j) = event(tangents_.col(j));
  last_ = transition;
}

Vector RollingDerivative::TimeColumn(OnlineFlow* flow) {
  ContactDynamics* dynamics = DynamicsAt(flow->NextInput());
  return dynamics->Field(flow->State(), flow->mode()).head(2 * system_.dof());
}

}  // namespace contact_flow
