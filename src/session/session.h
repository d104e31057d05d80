// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "asked.h"
#include "contact_flow/model/parameter_values.h"
#include "epoch_run.h"
#include "instant.h"
#include "step_limits.h"

namespace contact_flow {

/// How an epoch begins, and where the one before it has ended.
struct EpochBegin {
  std::uint32_t epoch = 0;  ///< 1, 2, …
  /// start, start_recording, reset_simulation, reset_world, set_state, apply_impulse or
  /// set_parameters.
  std::string cause;
  double t = 0;                       ///< [s]
  Vector q;                           ///< [nq]
  Vector v;                           ///< [d]
  Vector u;                           ///< [m]
  std::vector<Parameter> parameters;  ///< all of the model
  Vector impulse;                     ///< of apply_impulse [d], else empty
  double t_before = 0;                ///< [s]
  Vector q_before;                    ///< [nq], empty at the start
  Vector v_before;                    ///< [d], likewise
};

/// An input that was told.
struct ToldInput {
  std::uint32_t epoch = 0;
  double t = 0;  ///< from when on [s]
  Vector u;      ///< [m]
};

/// The simulation that goes on: its state, and what may be done to it. Time is what it is told: the
/// same calls in the same order give the same bits, so that verify_bag can repeat it; but limits
/// are of real time. For one thread.
///
/// The time of a session is a sequence of epochs. Each is one run of the hybrid flow, under the
/// inputs told on the way; a new one begins where the state is set, pushed or reset, or the model's
/// parameters change. Commands that are not in order throw std::invalid_argument and leave
/// everything as it was.
class Session {
 public:
  /// What a session tells of itself as it happens, to be recorded; any may be left out.
  struct Log {
    std::function<void(const EpochBegin&)> epoch;
    std::function<void(const ToldInput&)> input;
    std::function<void(const AskedMark&)> mark;
    std::function<void(const AskedPrediction&)> asked;
    std::function<void(const Prediction&)> predicted;
    std::function<void(const std::string&)> warning;  ///< a sentence for whoever looks on
  };

  /// `tangent_directions` are those of marks that name none; limits are measured by `clock`.
  Session(const Configuration& configuration, std::vector<std::string> tangent_directions, Log log,
          StepClock clock = {});

  const std::shared_ptr<const Setup>& setup() const { return run_->setup(); }
  const Setup& initial_setup() const { return *initial_setup_; }  ///< of the start
  double now() const { return run_->flow()->now(); }              ///< simulated time [s]
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
  /// The transition there, whose number is events().
  const Transition& transition() const { return run_->flow()->transition(); }
  bool changes_input() const { return transition().changes_input; }

  /// A new epoch from the present state: for a recording that begins here.
  void BeginEpoch(const std::string& cause);
  /// The initial state again, at time 0 with the initial parameters and inputs, or at
  /// the present time.
  void ResetSimulation();
  void ResetWorld();
  void SetState(const AskedState& state);
  void ApplyImpulse(const std::vector<std::string>& names, const std::vector<double>& impulse);
  void SetParameters(const std::vector<std::string>& names, const std::vector<double>& values);
  /// At simulated time t ≥ now() [s].
  void SetInput(double t, const std::vector<std::string>& names, const std::vector<double>& values);

  /// Marks now, until the epoch ends; or removes the mark. Returns the directions, with notes of
  /// what was left out or projected. Epoch and time of `asked` are not read.
  Directions Mark(AskedMark asked);
  bool marked() const { return run_->marked(); }

  Vector State() { return run_->flow()->State(); }
  /// λ now [n+l+r].
  Vector Force() { return run_->Force(); }
  Instant Now() { return run_->Now(); }
  /// The rolling derivative; nothing where nothing is marked.
  std::optional<MarkReading> ReadMark();
  Margins margins() const { return run_->flow()->margins(); }

  /// Numbers a request that is in order, and returns what the prediction starts from; others may
  /// make it while this goes on.
  Snapshot AskPrediction(AskedPrediction* asked);
  /// The answer is there.
  void TellPrediction(const Prediction& prediction);

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
  const StepClock clock_;
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

}  // namespace contact_flow
