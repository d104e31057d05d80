// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "contact_flow/HybridState.h"
#include "contact_flow/ModelDescription.h"
#include "contact_flow/OutcomePrediction.h"
#include "contact_flow/PredictionRequest.h"
#include "contact_flow/RollingTangents.h"
#include "contact_flow/SimulatorEpoch.h"
#include "contact_flow/SimulatorEvent.h"
#include "contact_flow/SimulatorInput.h"
#include "contact_flow/SimulatorMark.h"
#include "contact_flow/ros/epoch_run.h"

namespace contact_flow {
namespace ros_interface {

/// Repeats a recorded session from its epochs, inputs, marks and requests of predictions alone,
/// message by message in the order they were recorded, and compares events, states, rolling
/// derivatives and predictions with what comes of it, bit for bit. Each call answers how the
/// message differs, or "".
class SessionVerifier {
 public:
  std::string Take(const ModelDescription& model);
  /// Also compares where the epoch before has ended, and what can be computed of where this one
  /// begins.
  std::string Take(const SimulatorEpoch& epoch);
  std::string Take(const SimulatorInput& input);
  std::string Take(const SimulatorEvent& event);
  std::string Take(const HybridState& state);
  std::string Take(const SimulatorMark& mark);
  /// Of the instant of the state before it.
  std::string Take(const RollingTangents& tangents);
  std::string Take(const PredictionRequest& request);
  std::string Take(const OutcomePrediction& prediction);
  /// It was asked for before the recording began: nothing to compare with.
  bool Precedes(const OutcomePrediction& prediction) const {
    return first_epoch_ && prediction.epoch < *first_epoch_;
  }

 private:
  /// Goes on to t, or to the next event before or at it: then true.
  bool AdvanceTo(double t);
  /// The same where no event may be: the difference when there is one, or "".
  std::string AdvanceQuietlyTo(double t);
  /// The epoch a message must belong to; "" when it does.
  std::string Belongs(std::uint32_t epoch) const;

  std::optional<Configuration> configuration_;
  std::unique_ptr<EpochRun> run_;
  struct Asked {
    PredictionRequest request;
    Snapshot snapshot;
  };
  std::map<std::uint64_t, Asked> asked_;  // predictions to come, by index
  std::optional<std::uint32_t> first_epoch_;
  std::uint32_t epoch_ = 0;
  std::uint64_t events_ = 0;
  bool counting_ = false;  // events_ is known
};

}  // namespace ros_interface
}  // namespace contact_flow
