// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "contact_flow/HybridState.h"
#include "contact_flow/InitialState.h"
#include "contact_flow/OutcomePrediction.h"
#include "contact_flow/PredictionRequest.h"
#include "contact_flow/RollingTangents.h"
#include "contact_flow/SimulatorEpoch.h"
#include "contact_flow/SimulatorEvent.h"
#include "contact_flow/SimulatorInput.h"
#include "contact_flow/SimulatorMark.h"
#include "epoch_run.h"
#include "step_limits.h"

namespace contact_flow {
namespace ros_interface {

/// The simulation that goes on: its state, and what may be done to it. It knows neither clocks nor
/// topics, and the same calls in the same order give the same bits, so that verify_bag can repeat
/// it. For one thread.
///
/// The time of a session is a sequence of epochs. Each is one run of the hybrid flow, under the
/// inputs told on the way; a new one begins where the state is set, pushed or reset, or the model's
/// parameters change. Commands that are not in order throw std::invalid_argument and leave
/// everything as it was.
class Session {
 public:
  /// What a session tells of itself as it happens, to be recorded; stamps are left empty.
  struct Log {
    std::function<void(const SimulatorEpoch&)> epoch;
    std::function<void(const SimulatorInput&)> input;
    std::function<void(const SimulatorMark&)> mark;
    std::function<void(const PredictionRequest&)> asked;
    std::function<void(const OutcomePrediction&)> predicted;
  };

  Session(const Configuration& configuration, std::vector<std::string> tangent_directions, Log log);

  const std::shared_ptr<const Setup>& setup() const { return run_->setup(); }
  const Setup& initial_setup() const { return *initial_setup_; }  ///< of the start
  double now() const { return run_->flow()->now(); }  ///< simulated time [s]
  /// Of the present epoch; not kOk: it has come to its end.
  const Status& status() const { return ended_.ok() ? run_->flow()->status() : ended_; }
  std::uint32_t epoch() const { return epoch_; }
  std::uint64_t events() const { return events_; }
  ContactMode mode() const { return run_->flow()->mode(); }
  /// True when parameters have changed since the last call, and the first time.
  bool TakeParametersChanged();

  /// Goes on to t, or to the first transition before or at it: then true. Within the limits it may
  /// stop on the way, with now() < t, to go on in the next call; or for good, see status().
  bool AdvanceTo(double t);
  void LimitSteps(const StepLimits& limits);
  /// The present epoch has come to its end, where it stands.
  void End(Outcome outcome, const std::string& reason);
  /// The transition there.
  SimulatorEvent Event() const;
  bool changes_input() const { return run_->flow()->transition().changes_input; }

  /// A new epoch from the present state: for a recording that begins here.
  void BeginEpoch(const std::string& cause);
  /// The initial state again, at time 0 with the initial parameters and inputs, or at
  /// the present time.
  void ResetSimulation();
  void ResetWorld();
  void SetState(const InitialState& state);
  void ApplyImpulse(const std::vector<std::string>& names, const std::vector<double>& impulse);
  void SetParameters(const std::vector<std::string>& names, const std::vector<double>& values);
  /// At simulated time t ≥ now() [s].
  void SetInput(double t, const std::vector<std::string>& names, const std::vector<double>& values);

  /// Marks now, until the epoch ends; or removes the mark. Returns the directions, with warnings of
  /// what was left out or projected. Epoch and time of `asked` are not read.
  Directions Mark(SimulatorMark asked);
  bool marked() const { return run_->marked(); }

  Vector State() { return run_->flow()->State(); }
  /// λ now [n].
  Vector Force() { return run_->Force(); }
  Display::Instant Now() { return run_->Now(); }
  HybridState StateMsg();
  /// Nothing where nothing is marked.
  std::optional<RollingTangents> TangentsMsg();
  Margins margins() const { return run_->flow()->margins(); }

  /// Numbers a request that is in order, and returns what the prediction starts from; others may
  /// make it while this goes on.
  Snapshot AskPrediction(PredictionRequest* request);
  /// The answer is there.
  void TellPrediction(const OutcomePrediction& prediction);

 private:
  void Begin(const std::string& cause, double t, std::shared_ptr<const Setup> setup,
             const Vector& x, const Vector& u, const Vector& impulse);
  /// A new epoch from now, whose state is the present one after `change`.
  void Restart(const std::string& cause, std::shared_ptr<const Setup> setup,
               const std::function<void(Vector*)>& change, const Vector& impulse);
  void TellInput(double t, const Vector& u);
  void TellLostMark();

  const std::vector<std::string> tangent_directions_;
  const Log log_;
  const std::shared_ptr<const Setup> initial_setup_;
  std::unique_ptr<EpochRun> run_;
  std::uint32_t epoch_ = 0;
  std::uint64_t events_ = 0;
  std::uint64_t predictions_ = 0;
  bool parameters_changed_ = false;
  StepLimits limits_;
  Status ended_;         // the present epoch, by something else than its flow
  double begun_ = 0;     // simulated time of the present instant [s]
  double spent_ = 0;     // on it [s of processor time]
  double patience_ = 1;  // slices until it gives way, while there is no progress
};

/// What apply_impulse does to a state x [nq+d].
void Push(const Setup& setup, const Vector& impulse, Vector* x);

}  // namespace ros_interface
}  // namespace contact_flow
