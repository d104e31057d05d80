// SPDX-License-Identifier: BSD-3-Clause
#include "epoch_run.h"

#include <sstream>
#include <utility>

#include "contact_flow/flow/manifold_projection.h"
#include "src/ros/message/conversions.h"
#include "step_limits.h"

namespace contact_flow {
namespace ros_interface {
namespace {

std::shared_ptr<const MechanicalSystem> SystemOf(const std::shared_ptr<const Setup>& setup) {
  return {setup, setup->system.get()};
}

}  // namespace

EpochRun::EpochRun(std::shared_ptr<const Setup> setup, double t, const VectorRef& x,
                   const VectorRef& u)
    : setup_(std::move(setup)),
      flow_(SystemOf(setup_), t, x, u, setup_->options),
      dynamics_(system(), u) {}

bool EpochRun::AdvanceTo(double t) {
  while (true) {
    const bool passed = flow_.AdvanceTo(t);
    WithMark([&] { mark_->Follow(&flow_, passed); });
    if (!passed) return false;
    const Transition& transition = flow_.transition();
    if (!transition.changes_input || transition.mode_before != transition.mode_after) return true;
  }
}

/// Does something with the mark, if there is one, which must not take too long.
template <class Work>
void EpochRun::WithMark(const Work& work) {
  if (!mark_) return;
  try {
    const BudgetScope scope(ProcessorBudget(mark_seconds_));
    work();
  } catch (const BudgetExceeded&) {
    std::ostringstream text;
    text << "the derivative since the mark took more than " << mark_seconds_
         << " s of processor time for one instant: the mark is lost";
    loss_ = text.str();
    mark_.reset();
    flow_.KeepMotion(false);
  }
}

std::optional<RollingTangents> EpochRun::TangentsMsg() {
  std::optional<RollingTangents> message;
  WithMark([&] { message = mark_->Message(&flow_); });
  return message;
}

Vector EpochRun::SettledState() {
  flow_.Settle();
  Vector x = flow_.State();
  ProjectContacts(system(), flow_.mode(), &x);
  return x;
}

void EpochRun::Mark(const SimulatorMark& asked) {
  if (asked.clear) {
    mark_.reset();
    flow_.KeepMotion(false);
  } else {
    mark_ = std::make_unique<MarkedInstant>(*setup_, &flow_, asked);
  }
}

Vector EpochRun::Force() {
  dynamics_.SetInput(flow_.NextInput());
  dynamics_.Evaluate(flow_.State(), flow_.mode());
  return dynamics_.force();
}

Display::Instant EpochRun::Now() {
  const Vector force = Force();
  return {flow_.State(), flow_.NextInput(), force, dynamics_.acceleration(), flow_.mode()};
}

HybridState EpochRun::StateMsg() {
  const SystemDescription& description = system().description();
  const Vector x = flow_.State();
  HybridState message;
  message.t = flow_.now();
  message.coordinates = description.coordinates;
  message.velocities = description.velocities;
  message.constraints = description.constraints;
  message.inputs = description.inputs;
  message.tangential = TangentialNames(system());
  message.mode = flow_.mode().Names(description.constraints);
  message.mode_word = ToWord(description.constraints, flow_.mode());
  message.q = ToMsg(VectorRef(x.head(system().num_positions())));
  message.v = ToMsg(VectorRef(x.tail(system().dof())));
  const Vector force = Force();
  message.force = ToMsg(VectorRef(force.head(system().num_constraints())));
  message.tangential_force = Tangential(description, force);
  message.input = ToMsg(VectorRef(flow_.NextInput()));
  return message;
}

SimulatorEvent EpochRun::EventMsg() const {
  const SystemDescription& description = system().description();
  SimulatorEvent message;
  message.changes_input = flow_.transition().changes_input;
  message.constraints = description.constraints;
  message.tangential = TangentialNames(system());
  message.transition = ToMsg(description, flow_.transition());
  return message;
}

}  // namespace ros_interface
}  // namespace contact_flow
