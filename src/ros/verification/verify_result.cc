// SPDX-License-Identifier: BSD-3-Clause
#include "verify_result.h"

#include <algorithm>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "contact_flow/flow/status.h"
#include "src/ros/answer/answers.h"
#include "src/ros/answer/assumptions_answer.h"
#include "src/ros/answer/controllability_answer.h"
#include "src/ros/answer/covariance_answer.h"
#include "src/ros/answer/ensemble_answer.h"
#include "src/ros/answer/feedback_answer.h"
#include "src/ros/answer/gradient_answer.h"
#include "src/ros/answer/linearize_answer.h"
#include "src/ros/answer/optimization_answer.h"
#include "src/ros/answer/periodic_orbit_answer.h"
#include "src/ros/answer/poincare_answer.h"
#include "src/ros/answer/policy_answer.h"
#include "src/ros/answer/stability_answer.h"
#include "src/ros/answer/trajectory_answer.h"
#include "src/ros/request/ensemble_problem.h"
#include "src/ros/request/model_description.h"
#include "src/ros/service/handler.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr char kStoppedAt[] = " (stopped at t = ";

/// Without the budget of time: that of the setup, as much as may be.
template <class Request>
Request Unhurried(Request request) {
  const_cast<SimulationOptions&>(OptionsOf(request)).max_seconds = 0;
  return request;
}

template <class Result>
bool Unfinished(const Result& result) {
  return result.outcome == kCancelledOutcome || EndedByTime(result);
}

/// "max_steps = …" of the repeated run becomes the "max_seconds = …" of the recorded one.
std::string WithBudgetOf(const std::string& recorded, const std::string& computed) {
  const std::size_t end = recorded.find(kStoppedAt), cut = computed.find(kStoppedAt);
  if (recorded.compare(0, 14, "max_seconds = ") != 0 || end == std::string::npos ||
      computed.compare(0, 12, "max_steps = ") != 0 || cut == std::string::npos) {
    return computed;
  }
  return recorded.substr(0, end) + computed.substr(cut);
}

}  // namespace

std::string BagVerifier::Repeater::Take(const ModelDescription& description) {
  setup_.reset();
  Configuration configuration = FromMsg(description);
  ModelDescription computed = ToMsg(Setup(configuration));
  computed.header.stamp = description.header.stamp;
  const std::string difference =
      Serialize(description) == Serialize(computed) ? "" : FirstDifference(description, computed);
  node_seconds_ = configuration.options.max_seconds;
  configuration.options.max_seconds = kMostSeconds;
  configuration.options.cancelled = [this] { return std::chrono::steady_clock::now() > deadline_; };
  setup_ = std::make_unique<Setup>(configuration);
  return difference;
}

void BagVerifier::Repeater::BeginClock() {
  deadline_ = std::chrono::steady_clock::now() +
              std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                  std::chrono::duration<double>(max_seconds_));
}

BagVerifier::Repeater::Verdict BagVerifier::Repeater::TooLong() const {
  return {"it takes longer than " + std::to_string(max_seconds_) + " s", true};
}

/// The budget of memory of a request, as the node has counted it, and the time that is left.
template <class Request, class Body>
auto BagVerifier::Repeater::Within(const Request& request, const Body& answer) {
  BudgetLimits limits = LimitsOf(*setup_, OptionsOf(request));
  limits.max_seconds = std::numeric_limits<double>::infinity();
  limits.cancelled = setup_->options.cancelled;
  const double most = std::min(limits.max_megabytes, kLargestAnswer);
  const Budget budget(std::move(limits));
  const BudgetScope scope(budget);
  decltype(answer()) result;
  AnswerOrEnd(most, &result, answer);
  return result;
}

template <class RecordMessage>
BagVerifier::Repeater::Verdict BagVerifier::Repeater::Again(const RecordMessage& record) {
  if (!setup_) return {"no model description before it", false};
  BeginClock();
  const auto request = Unhurried(record.request);
  auto computed = Within(request, [&] { return Answer(*setup_, request); });
  if (Unfinished(computed)) return TooLong();
  computed.header = record.result.header;
  if (Serialize(record.result) == Serialize(computed)) return {};
  return {FirstDifference(record.result, computed), false};
}

/// How far a search had come, from as many iterations.
template <class RecordMessage>
auto BagVerifier::Repeater::UpTo(const RecordMessage& record) {
  const std::size_t count = record.result.iterations.size();
  std::size_t seen = 0;
  Watch watch;
  watch.cancelled = [&] { return seen >= count || setup_->options.cancelled(); };
  watch.report = [&](int, double, double, const Vector&) { ++seen; };
  return Answer(*setup_, Unhurried(record.request), watch);
}

/// "" where the message tells the budget of time that the request had.
template <class RecordMessage>
std::string BagVerifier::Repeater::OtherBudget(const RecordMessage& record) const {
  using Result = std::decay_t<decltype(record.result)>;
  double budget = LimitsOf(*setup_, OptionsOf(record.request)).max_seconds;
  if (OptionsOf(record.request).max_seconds == 0) {
    const bool is_goal = kIsSearch<Result> || std::is_same_v<Result, EnsembleResult>;
    budget = is_goal ? kMaxSeconds : node_seconds_;
  }
  std::ostringstream sentence;
  sentence.precision(4);
  sentence << "max_seconds = " << budget << ' ';
  if (record.result.message.find(sentence.str()) != std::string::npos) return "";
  return "ended by another budget of time than it had, " + sentence.str() + "s";
}

/// What time has ended holds what does not depend on when.
template <class RecordMessage>
BagVerifier::Repeater::Verdict BagVerifier::Repeater::Ended(const RecordMessage& record) {
  using Result = std::decay_t<decltype(record.result)>;
  if (!setup_) return {"no model description before it", false};
  const std::string other = OtherBudget(record);
  if (!other.empty()) return {other, false};
  Result expected;
  if constexpr (kIsSearch<Result>) {
    BeginClock();
    if (!record.result.iterations.empty()) expected = WhatTimeLeaves(UpTo(record));
    if (std::chrono::steady_clock::now() > deadline_) return TooLong();
  }
  expected.header = record.result.header;
  expected.outcome = record.result.outcome;
  expected.message = record.result.message;
  if (Serialize(record.result) != Serialize(expected)) {
    return {FirstDifference(record.result, expected), false};
  }
  return {"", false, "ended by its budget of time; what it holds is the same, bit for bit"};
}

BagVerifier::Repeater::Verdict BagVerifier::Repeater::Repeat(const SimulationRecord& record) {
  if (!EndedByTime(record.result)) return Again(record);
  SimulationRecord bounded = record;
  bounded.request.options.max_steps =
      static_cast<std::int64_t>(record.result.steps + record.result.rejected_steps);
  if (bounded.request.options.max_steps == 0) return Ended(record);  // before the first step
  const auto limit = record.request.options.max_steps;
  if (bounded.request.options.max_steps < 0 ||
      (limit > 0 && bounded.request.options.max_steps > limit)) {
    return {"it has taken more steps than it may", false};
  }
  if (!setup_) return {"no model description before it", false};
  const Verdict whole = UpToStep(bounded);
  if (whole.unknown || whole.difference.empty()) return whole;
  // Time may end in the middle of an attempt, which is counted and comes to nothing.
  --bounded.request.options.max_steps;
  if (record.result.rejected_steps == 0 || bounded.request.options.max_steps == 0) return whole;
  const Verdict without = UpToStep(bounded);
  return without.unknown || without.difference.empty() ? without : whole;
}

/// The same but for the sentence, which says another budget, and an attempt that was not finished.
BagVerifier::Repeater::Verdict BagVerifier::Repeater::UpToStep(const SimulationRecord& record) {
  BeginClock();
  const SimulationRequest request = Unhurried(record.request);
  ContactTrajectory computed = Within(request, [&] { return Answer(*setup_, request); });
  if (Unfinished(computed)) return TooLong();
  const ContactTrajectory& recorded = record.result;
  computed.header = recorded.header;
  computed.message = WithBudgetOf(recorded.message, computed.message);
  for (std::size_t i = 0; i < computed.warnings.size() && i < recorded.warnings.size(); ++i) {
    computed.warnings[i].message =
        WithBudgetOf(recorded.warnings[i].message, computed.warnings[i].message);
  }
  if (computed.rejected_steps + 1 == recorded.rejected_steps) {
    computed.rejected_steps = recorded.rejected_steps;
    computed.field_evaluations = recorded.field_evaluations;
  }
  if (Serialize(recorded) == Serialize(computed)) return {};
  return {FirstDifference(recorded, computed), false};
}

/// One that time has ended is one of fewer runs.
BagVerifier::Repeater::Verdict BagVerifier::Repeater::Repeat(const EnsembleRecord& record) {
  if (!EndedByTime(record.result)) return Again(record);
  if (record.result.runs == 0) return Ended(record);
  if (!setup_) return {"no model description before it", false};
  const std::string other = OtherBudget(record);
  if (!other.empty()) return {other, false};
  const std::uint64_t all = ResolveEnsemble(*setup_, record.request).count;
  if (record.result.runs % Tally::kBlock != 0 || record.result.runs >= all) {
    return {"it counts other runs than a budget of time leaves", false};
  }
  EnsembleRecord bounded = record;
  bounded.request.runs = record.result.runs;
  bounded.result.outcome = 0;
  bounded.result.message.clear();
  Verdict verdict = Again(bounded);
  if (verdict.difference.empty()) {
    verdict.note = "ended by its budget of time; what it holds is the same, bit for bit";
  }
  return verdict;
}

template <class RecordMessage>
BagVerifier::Repeater::Verdict BagVerifier::Repeater::Repeat(const RecordMessage& record) {
  return EndedByTime(record.result) ? Ended(record) : Again(record);
}

template <class Type>
bool BagVerifier::Record(const BagMessage& message, const Type& type) {
  using RecordMessage = typename Type::Record;
  if (!Is<RecordMessage>(message)) return false;
  const auto record = Get<RecordMessage>(message, type.Role());
  if (Serialize(record.header) != Serialize(record.result.header) ||
      record.header.stamp != message.time) {
    Differs(message, "stamps of message, record and result");
  }
  copies_.clear();
  const auto expect = [&](const auto& topic) {
    using Message = typename std::decay_t<decltype(topic)>::Message;
    copies_[ros::message_traits::DataType<Message>::value()] = Serialize(topic.Of(record.result));
  };
  std::apply([&](const auto&... topic) { (expect(topic), ...); }, type.topics);
  const Repeater::Verdict verdict = repeater_->Repeat(record);
  if (verdict.unknown) {
    ++result_.gaps;
    Line(message, "NOT VERIFIED: " + verdict.difference);
  } else if (!verdict.difference.empty()) {
    Differs(message, verdict.difference);
  } else {
    ++result_.verified;
    Line(message, verdict.note);
  }
  return true;
}

/// A message on an ordinary topic: it follows the record that it is made of.
template <class Topic>
bool BagVerifier::Copy(const BagMessage& message, const Topic& topic) {
  using Message = typename Topic::Message;
  if (!Is<Message>(message)) return false;
  const auto copy = Get<Message>(message, topic.name);
  const auto expected = copies_.find(message.connection->at("type"));
  if (expected == copies_.end() || Serialize(copy) != expected->second) {
    Differs(message, "not the result of the record before it");
  }
  if (expected != copies_.end()) copies_.erase(expected);
  return true;
}

bool BagVerifier::TakeResult(const BagMessage& message) {
  bool taken = false;
  ForEachRecordType([&](const auto& type) { taken = taken || Record(message, type); });
  ForEachResultTopic(
      [&](const auto&, const auto& topic) { taken = taken || Copy(message, topic); });
  return taken;
}

}  // namespace ros_interface
}  // namespace contact_flow
