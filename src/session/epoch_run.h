// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/online_flow.h"
#include "instant.h"
#include "marked_instant.h"
#include "prediction.h"
#include "setup.h"
#include "step_limits.h"

namespace contact_flow {

/// One epoch of a session as it goes on: a run of the hybrid flow under one setup, and the instant
/// that is marked on its way. The same calls give the same bits, in a simulator and where
/// verify_bag repeats it.
class EpochRun {
 public:
  /// Begins at t [s]. Throws std::invalid_argument for a state from which no run begins.
  EpochRun(std::shared_ptr<const Setup> setup, double t, const VectorRef& x, const VectorRef& u);

  const std::shared_ptr<const Setup>& setup() const { return setup_; }
  const MechanicalSystem& system() const { return *setup_->system; }
  OnlineFlow* flow() { return &flow_; }

  /// Goes on to t, or to the first event before or at it: then true. An input that changes is one
  /// only if contacts let go.
  bool AdvanceTo(double t);
  /// From now on the mark is lost, with a reason, where its derivative takes longer than that for
  /// one instant [s of processor time, by this clock].
  void LimitMark(double seconds, const StepClock& clock) {
    mark_seconds_ = seconds;
    clock_ = clock;
  }
  /// Why the mark was lost; "" where it was not. Asked once.
  std::string TakeLoss() { return std::exchange(loss_, ""); }
  /// Now as the end of a step; what rests in contact is put exactly on it.
  Vector SettledState();

  /// Marks now, or removes the mark; throws std::invalid_argument and leaves the last one.
  void Mark(const AskedMark& asked);
  bool marked() const { return mark_ != nullptr; }
  /// Of the mark.
  const Directions& directions() const { return mark_->directions(); }
  /// Nothing where the mark is lost.
  std::optional<MarkReading> ReadMark();

  Vector Force();  ///< λ now [n+l+r]
  Instant Now();
  /// What a prediction starts from; throws std::invalid_argument for a request that
  /// is not in order.
  Snapshot Present(const AskedPrediction& asked) { return TakeSnapshot(setup_, &flow_, asked); }

 private:
  template <class Work>
  void WithMark(const Work& work);

  const std::shared_ptr<const Setup> setup_;
  OnlineFlow flow_;
  ContactDynamics dynamics_;
  std::unique_ptr<MarkedInstant> mark_;
  StepClock clock_;
  double mark_seconds_ = std::numeric_limits<double>::infinity();
  std::string loss_;
};

}  // namespace contact_flow
