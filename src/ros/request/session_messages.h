// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "contact_flow/HybridState.h"
#include "contact_flow/OutcomePrediction.h"
#include "contact_flow/PredictionRequest.h"
#include "contact_flow/RollingTangents.h"
#include "contact_flow/SimulatorEpoch.h"
#include "contact_flow/SimulatorEvent.h"
#include "contact_flow/SimulatorInput.h"
#include "contact_flow/SimulatorMark.h"
#include "request.h"
#include "src/session/session.h"

/// What a session is asked and what it tells, as messages. Headers are left empty.
namespace contact_flow {
namespace ros_interface {

AskedMark FromMsg(const SimulatorMark& message);
AskedPrediction FromMsg(const PredictionRequest& message);

SimulatorEpoch ToMsg(const EpochBegin& begin);
SimulatorInput ToMsg(const ToldInput& input);
SimulatorMark ToMsg(const AskedMark& mark);
PredictionRequest ToMsg(const AskedPrediction& asked);
OutcomePrediction ToMsg(const Prediction& prediction);
/// The transition that is number `index` of a session.
SimulatorEvent ToMsg(const MechanicalSystem& system, const Transition& transition,
                     std::uint32_t epoch, std::uint64_t index);
/// An instant after so many events.
HybridState ToMsg(const MechanicalSystem& system, const Instant& now, std::uint32_t epoch,
                  std::uint64_t events);
RollingTangents ToMsg(const SystemDescription& description, const MarkReading& reading,
                      std::uint32_t epoch);
/// The present of a session.
HybridState StateOf(Session* session);

}  // namespace ros_interface
}  // namespace contact_flow
