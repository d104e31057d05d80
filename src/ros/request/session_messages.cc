// SPDX-License-Identifier: BSD-3-Clause
#include "session_messages.h"

#include "src/ros/message/conversions.h"
#include "src/ros/message/warnings.h"

namespace contact_flow {
namespace ros_interface {
namespace {

/// Into the fields that DirectionsOf reads.
template <class Message>
void SetDirections(const AskedDirections& asked, Message* message) {
  message->directions = asked.names;
  message->direction_matrix.rows = asked.matrix.rows;
  message->direction_matrix.cols = asked.matrix.cols;
  message->direction_matrix.data = asked.matrix.data;
  message->project_directions = asked.project;
}

}  // namespace

AskedMark FromMsg(const SimulatorMark& m) {
  AskedMark asked;
  asked.epoch = m.epoch;
  asked.t = m.t;
  asked.directions = DirectionsOf(m);
  asked.by_inputs = m.by_inputs;
  asked.by_parameters = m.by_parameters;
  asked.clear = m.clear;
  return asked;
}

AskedPrediction FromMsg(const PredictionRequest& m) {
  AskedPrediction asked;
  asked.epoch = m.epoch;
  asked.index = m.index;
  asked.t = m.t;
  asked.horizon = m.horizon;
  asked.directions = DirectionsOf(m);
  asked.size = m.size;
  return asked;
}

SimulatorEpoch ToMsg(const EpochBegin& begin) {
  SimulatorEpoch m;
  m.epoch = begin.epoch;
  m.cause = begin.cause;
  m.t = begin.t;
  m.q = ToMsg(VectorRef(begin.q));
  m.v = ToMsg(VectorRef(begin.v));
  m.input = ToMsg(VectorRef(begin.u));
  for (const Parameter& parameter : begin.parameters) {
    m.parameter_names.push_back(parameter.name);
    m.parameter_values.push_back(parameter.value);
  }
  m.impulse = ToMsg(VectorRef(begin.impulse));
  m.t_before = begin.t_before;
  m.q_before = ToMsg(VectorRef(begin.q_before));
  m.v_before = ToMsg(VectorRef(begin.v_before));
  return m;
}

SimulatorInput ToMsg(const ToldInput& input) {
  SimulatorInput m;
  m.epoch = input.epoch;
  m.t = input.t;
  m.input = ToMsg(VectorRef(input.u));
  return m;
}

SimulatorMark ToMsg(const AskedMark& mark) {
  SimulatorMark m;
  m.epoch = mark.epoch;
  m.t = mark.t;
  SetDirections(mark.directions, &m);
  m.by_inputs = mark.by_inputs;
  m.by_parameters = mark.by_parameters;
  m.clear = mark.clear;
  return m;
}

PredictionRequest ToMsg(const AskedPrediction& asked) {
  PredictionRequest m;
  m.epoch = asked.epoch;
  m.index = asked.index;
  m.t = asked.t;
  m.horizon = asked.horizon;
  SetDirections(asked.directions, &m);
  m.size = asked.size;
  return m;
}

OutcomePrediction ToMsg(const Prediction& prediction) {
  OutcomePrediction m;
  m.epoch = prediction.epoch;
  m.index = prediction.index;
  m.outcome = static_cast<std::uint8_t>(prediction.outcome);
  m.message = prediction.message;  // which has the sentences of the warnings
  m.warnings = ToMsg(prediction.warnings);
  const std::vector<ResultWarning> notes = ToMsg(prediction.notes);
  m.warnings.insert(m.warnings.end(), notes.begin(), notes.end());
  m.t_begin = prediction.t_begin;
  m.t_end = prediction.t_end;
  m.q = ToMsg(VectorRef(prediction.q));
  m.v = ToMsg(VectorRef(prediction.v));
  m.mode_sequence = prediction.modes;
  m.mode_words = prediction.mode_words;
  m.event_names = prediction.event_names;
  m.event_times = prediction.event_times;
  m.direction_names = prediction.direction_names;
  m.derivatives = ToMsg(MatrixRef(prediction.derivatives));
  m.fan = ToMsg(MatrixRef(prediction.fan));
  m.time_derivative = ToMsg(VectorRef(prediction.time_derivative));
  return m;
}

SimulatorEvent ToMsg(const MechanicalSystem& system, const Transition& transition,
                     std::uint32_t epoch, std::uint64_t index) {
  SimulatorEvent m;
  m.epoch = epoch;
  m.index = index;
  m.changes_input = transition.changes_input;
  m.constraints = system.description().constraints;
  m.tangential = TangentialNames(system);
  m.transition = ToMsg(system.description(), transition);
  return m;
}

HybridState ToMsg(const MechanicalSystem& system, const Instant& now, std::uint32_t epoch,
                  std::uint64_t events) {
  const SystemDescription& description = system.description();
  HybridState m;
  m.epoch = epoch;
  m.events = events;
  m.t = now.t;
  m.coordinates = description.coordinates;
  m.velocities = description.velocities;
  m.constraints = description.constraints;
  m.inputs = description.inputs;
  m.tangential = TangentialNames(system);
  m.mode = now.mode.Names(description.constraints);
  m.mode_word = ToWord(description.constraints, now.mode);
  m.q = ToMsg(VectorRef(now.x.head(system.num_positions())));
  m.v = ToMsg(VectorRef(now.x.tail(system.dof())));
  m.force = ToMsg(VectorRef(now.force.head(system.num_constraints())));
  m.tangential_force = Tangential(description, now.force);
  m.input = ToMsg(VectorRef(now.u));
  return m;
}

RollingTangents ToMsg(const SystemDescription& description, const MarkReading& reading,
                      std::uint32_t epoch) {
  RollingTangents m;
  m.epoch = epoch;
  m.t_mark = reading.t_mark;
  m.t = reading.now.t;
  m.velocities = description.velocities;
  m.direction_names = reading.names;
  m.directions = ToMsg(MatrixRef(reading.directions.transpose()));
  m.tangents = ToMsg(MatrixRef(reading.now.tangents.transpose()));
  m.time_derivative = ToMsg(VectorRef(reading.now.time));
  m.outcome = static_cast<std::uint8_t>(reading.now.status.outcome);
  m.message = reading.now.status.message;
  return m;
}

HybridState StateOf(Session* session) {
  return ToMsg(*session->setup()->system, session->Now(), session->epoch(), session->events());
}

}  // namespace ros_interface
}  // namespace contact_flow
