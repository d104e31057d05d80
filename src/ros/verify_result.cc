// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/verify_result.h"

#include <stdexcept>

#include "contact_flow/flow/status.h"
#include "contact_flow/ros/answers.h"
#include "contact_flow/ros/assumptions_answer.h"
#include "contact_flow/ros/controllability_answer.h"
#include "contact_flow/ros/conversions.h"
#include "contact_flow/ros/covariance_answer.h"
#include "contact_flow/ros/linearize_answer.h"
#include "contact_flow/ros/optimization_answer.h"
#include "contact_flow/ros/periodic_orbit_answer.h"
#include "contact_flow/ros/poincare_answer.h"
#include "contact_flow/ros/stability_answer.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr double kMostSeconds = 3600;  // that a model may be given
constexpr char kStoppedAt[] = " (stopped at t = ";

template <class Result>
bool EndedByTime(const Result& result) {
  return result.outcome == static_cast<int>(Outcome::kBudgetExceeded) &&
         result.message.find("max_seconds") != std::string::npos;
}

template <class Result>
bool Unfinished(const Result& result) {
  return result.outcome == static_cast<int>(Outcome::kCancelled) || EndedByTime(result);
}

/// Without the budget of time, where the request has one.
template <class Request>
auto Unhurried(Request request, int) -> decltype(request.options, Request()) {
  request.options.max_seconds = 0;  // that of the setup, as much as may be
  return request;
}
template <class Request>
Request Unhurried(Request request, long) {
  return request;
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
  const std::string difference = Serialize(description) == Serialize(computed)
                                     ? ""
                                     : FirstDifference(description, computed);
  configuration.options.max_seconds = kMostSeconds;
  configuration.options.cancelled = [this] {
    return std::chrono::steady_clock::now() > deadline_;
  };
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

template <class RecordMessage>
BagVerifier::Repeater::Verdict BagVerifier::Repeater::Again(const RecordMessage& record) {
  if (!setup_) return {"no model description before it", false};
  BeginClock();
  auto computed = Answer(*setup_, Unhurried(record.request, 0));
  if (Unfinished(computed)) return TooLong();
  computed.header = record.result.header;
  if (Serialize(record.result) == Serialize(computed)) return {};
  return {FirstDifference(record.result, computed), false};
}

BagVerifier::Repeater::Verdict BagVerifier::Repeater::Repeat(const SimulationRecord& record) {
  if (!EndedByTime(record.result)) return Again(record);
  SimulationRecord bounded = record;
  bounded.request.options.max_steps =
      static_cast<std::int64_t>(record.result.steps + record.result.rejected_steps);
  if (bounded.request.options.max_steps == 0) {
    return {"its time was over before the first step", true};
  }
  const auto limit = record.request.options.max_steps;
  if (bounded.request.options.max_steps < 0 ||
      (limit > 0 && bounded.request.options.max_steps > limit)) {
    return {"it has taken more steps than it may", false};
  }
  // The same but for the sentence, which says another budget.
  if (!setup_) return {"no model description before it", false};
  BeginClock();
  ContactTrajectory computed = Answer(*setup_, Unhurried(bounded.request, 0));
  if (Unfinished(computed)) return TooLong();
  computed.header = record.result.header;
  computed.message = WithBudgetOf(record.result.message, computed.message);
  for (std::size_t i = 0; i < computed.warnings.size() && i < record.result.warnings.size(); ++i) {
    computed.warnings[i].message =
        WithBudgetOf(record.result.warnings[i].message, computed.warnings[i].message);
  }
  if (Serialize(record.result) == Serialize(computed)) return {};
  return {FirstDifference(record.result, computed), false};
}

// Where others were when their time was over is not recorded.
#define CONTACT_FLOW_REPEAT(Record)                                                           \
  BagVerifier::Repeater::Verdict BagVerifier::Repeater::Repeat(const Record& record) {        \
    if (EndedByTime(record.result)) return {"ended by its budget of time; where, is not recorded", true}; \
    return Again(record);                                                                     \
  }
CONTACT_FLOW_REPEAT(DerivativeRecord)
CONTACT_FLOW_REPEAT(ComparisonRecord)
CONTACT_FLOW_REPEAT(AssumptionRecord)
CONTACT_FLOW_REPEAT(LinearizationRecord)
CONTACT_FLOW_REPEAT(PoincareRecord)
CONTACT_FLOW_REPEAT(StabilityRecord)
CONTACT_FLOW_REPEAT(ControllabilityRecord)
CONTACT_FLOW_REPEAT(CovarianceRecord)
CONTACT_FLOW_REPEAT(PeriodicOrbitRecord)
CONTACT_FLOW_REPEAT(OptimizationRecord)
#undef CONTACT_FLOW_REPEAT

std::map<std::string, Bytes> BagVerifier::Repeater::Copies(const SimulationRecord& record) {
  return {{ros::message_traits::DataType<ContactTrajectory>::value(), Serialize(record.result)},
          {ros::message_traits::DataType<ModeSequence>::value(),
           Serialize(ToModeSequence(record.result))}};
}

std::map<std::string, Bytes> BagVerifier::Repeater::Copies(const DerivativeRecord& record) {
  return {{ros::message_traits::DataType<OutcomeDerivative>::value(), Serialize(record.result)}};
}

}  // namespace ros_interface
}  // namespace contact_flow
