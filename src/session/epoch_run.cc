// SPDX-License-Identifier: BSD-3-Clause
#include "epoch_run.h"

#include <sstream>
#include <utility>

#include "contact_flow/flow/manifold_projection.h"

namespace contact_flow {
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
    const BudgetScope scope(clock_.OfProcessor(mark_seconds_));
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

std::optional<MarkReading> EpochRun::ReadMark() {
  std::optional<MarkReading> reading;
  WithMark([&] { reading = mark_->Read(&flow_); });
  return reading;
}

Vector EpochRun::SettledState() {
  flow_.Settle();
  Vector x = flow_.State();
  ProjectContacts(system(), flow_.mode(), &x);
  return x;
}

void EpochRun::Mark(const AskedMark& asked) {
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

Instant EpochRun::Now() {
  const Vector force = Force();
  return {flow_.now(), flow_.State(), flow_.NextInput(), force, dynamics_.acceleration(),
          flow_.mode()};
}

}  // namespace contact_flow
