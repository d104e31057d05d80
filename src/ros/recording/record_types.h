// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "contact_flow/AssumptionRecord.h"
#include "contact_flow/ComparisonRecord.h"
#include "contact_flow/ControllabilityRecord.h"
#include "contact_flow/CovarianceRecord.h"
#include "contact_flow/DerivativeRecord.h"
#include "contact_flow/EnsembleRecord.h"
#include "contact_flow/GradientRecord.h"
#include "contact_flow/LinearizationRecord.h"
#include "contact_flow/ModeSequence.h"
#include "contact_flow/OptimizationRecord.h"
#include "contact_flow/PeriodicOrbitRecord.h"
#include "contact_flow/PoincareRecord.h"
#include "contact_flow/PolicyRecord.h"
#include "contact_flow/SimulationRecord.h"
#include "contact_flow/StabilityRecord.h"
#include "contact_flow/StepFeedbackRecord.h"
#include "contact_flow/TrajectoryRecord.h"
#include "src/ros/message/conversions.h"

/// The one list of the types of records. What the node publishes and records of them follows from
/// it (outlet.h), and what verify_bag repeats (verification/verify_result.cc): a new type is one
/// line of kRecordTypes.
namespace contact_flow {
namespace ros_interface {

/// An ordinary topic, latched, whose messages are made of the results of one type of record. They
/// follow their record in the bag.
template <class Result, class TopicMessage>
struct ResultTopic {
  using Message = TopicMessage;
  /// The message is the result itself.
  constexpr ResultTopic(const char* topic) : name(topic) {
    static_assert(std::is_same_v<Message, Result>, "say how the message is made of the result");
  }
  /// It is made by `make`, with the result's header.
  constexpr ResultTopic(const char* topic, Message (*make)(const Result&))
      : name(topic), of(make) {}

  Message Of(const Result& result) const {
    if constexpr (std::is_same_v<Message, Result>) {
      if (of == nullptr) return result;
    }
    return of(result);
  }

  const char* name;
  Message (*of)(const Result&) = nullptr;
};

/// A type of record: a request and its result, on the topic "record/NAME"; and the messages of the
/// ordinary topics that are made of the result.
template <class RecordMessage, class... TopicMessages>
struct RecordType {
  using Record = RecordMessage;
  using Result = typename RecordMessage::_result_type;
  const char* name;
  std::tuple<ResultTopic<Result, TopicMessages>...> topics = {};

  std::string Role() const { return std::string("record/") + name; }
};

inline constexpr std::tuple kRecordTypes{
    RecordType<SimulationRecord, ContactTrajectory, ModeSequence>{
        "simulation", {{"trajectory"}, {"mode_sequence", &ToModeSequence}}},
    RecordType<DerivativeRecord, OutcomeDerivative>{"derivative", {{"b_derivative"}}},
    RecordType<ComparisonRecord>{"comparison"},
    RecordType<AssumptionRecord>{"assumptions"},
    RecordType<LinearizationRecord>{"linearization"},
    RecordType<PoincareRecord>{"poincare_map"},
    RecordType<StabilityRecord>{"stability"},
    RecordType<StepFeedbackRecord>{"step_feedback"},
    RecordType<ControllabilityRecord>{"controllability"},
    RecordType<CovarianceRecord>{"covariance"},
    RecordType<GradientRecord>{"gradient"},
    RecordType<PolicyRecord>{"policy"},
    RecordType<PeriodicOrbitRecord>{"periodic_orbit"},
    RecordType<OptimizationRecord>{"optimization"},
    RecordType<TrajectoryRecord>{"trajectory"},
    RecordType<EnsembleRecord>{"ensemble"},
};

/// Calls `visit(type)` with every RecordType, in the order of the list.
template <class Visit>
constexpr void ForEachRecordType(const Visit& visit) {
  std::apply([&](const auto&... type) { (visit(type), ...); }, kRecordTypes);
}
/// Calls `visit(type, topic)` with every ResultTopic of every RecordType.
template <class Visit>
constexpr void ForEachResultTopic(const Visit& visit) {
  ForEachRecordType([&](const auto& type) {
    std::apply([&](const auto&... topic) { (visit(type, topic), ...); }, type.topics);
  });
}

/// The entry of one record in the list; does not compile where there is none.
template <class Record, std::size_t place = 0>
constexpr const auto& RecordTypeOf() {
  using Type = std::tuple_element_t<place, std::remove_const_t<decltype(kRecordTypes)>>;
  if constexpr (std::is_same_v<typename Type::Record, Record>) {
    return std::get<place>(kRecordTypes);
  } else {
    return RecordTypeOf<Record, place + 1>();
  }
}

/// The names, below that of the node, of all topics with results: the ordinary ones, then those of
/// the records.
inline std::vector<std::string> ResultRoles() {
  std::vector<std::string> roles;
  ForEachResultTopic([&](const auto&, const auto& topic) { roles.push_back(topic.name); });
  ForEachRecordType([&](const auto& type) { roles.push_back(type.Role()); });
  return roles;
}

}  // namespace ros_interface
}  // namespace contact_flow
