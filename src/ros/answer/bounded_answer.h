// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/serialization.h>

#include <cstdint>
#include <string>
#include <type_traits>

#include "contact_flow/ContactTrajectory.h"
#include "contact_flow/ControllabilityResult.h"
#include "contact_flow/EnsembleResult.h"
#include "contact_flow/OptimizationResult.h"
#include "contact_flow/PeriodicOrbitResult.h"
#include "contact_flow/PoincareResult.h"
#include "contact_flow/StabilityRequest.h"
#include "contact_flow/StabilityResult.h"
#include "contact_flow/StepFeedbackRequest.h"
#include "contact_flow/StepFeedbackResult.h"
#include "contact_flow/TrajectoryResult.h"
#include "contact_flow/budget.h"
#include "contact_flow/flow/status.h"

/// What becomes of an answer whose budget ends. Time is no part of a result: what is left of one
/// that it has ended does not depend on when, so that verify_bag can tell what has to be there.
namespace contact_flow {
namespace ros_interface {

/// roscpp's clients take no longer answer [10⁶ byte].
inline constexpr double kLargestAnswer = 1000;

template <class Result>
inline constexpr bool kIsSearch =
    std::is_same_v<Result, OptimizationResult> || std::is_same_v<Result, PeriodicOrbitResult> ||
    std::is_same_v<Result, TrajectoryResult>;
/// Those whose outcomes are their own.
template <class Result>
inline constexpr bool kIsAnalysis =
    kIsSearch<Result> || std::is_same_v<Result, PoincareResult> ||
    std::is_same_v<Result, StabilityResult> || std::is_same_v<Result, ControllabilityResult> ||
    std::is_same_v<Result, StepFeedbackResult> || std::is_same_v<Result, EnsembleResult>;
template <class Result>
inline constexpr std::uint8_t kBudgetOutcome =
    kIsAnalysis<Result> ? 6 : static_cast<std::uint8_t>(Outcome::kBudgetExceeded);
inline constexpr std::uint8_t kCancelledOutcome = static_cast<std::uint8_t>(Outcome::kCancelled);

/// Where a request says what it may take.
template <class Request>
const SimulationOptions& OptionsOf(const Request& request) {
  return request.options;
}
inline const SimulationOptions& OptionsOf(const StabilityRequest& request) {
  return request.return_map.options;
}
inline const SimulationOptions& OptionsOf(const StepFeedbackRequest& request) {
  return request.return_map.options;
}

/// What a budget of time leaves of a result besides outcome and message: nothing, …
template <class Result>
Result WhatTimeLeaves(const Result&) {
  return Result();
}
/// … of searches the last of the points that they had reached, and how, …
inline OptimizationResult WhatTimeLeaves(const OptimizationResult& all) {
  OptimizationResult kept;
  if (all.iterations.empty()) return kept;
  kept.model = all.model;
  kept.unknowns = all.unknowns;
  kept.values = all.values;
  kept.cost = all.cost;
  kept.iterations = all.iterations;
  return kept;
}
inline TrajectoryResult WhatTimeLeaves(const TrajectoryResult& all) {
  TrajectoryResult kept;
  if (all.iterations.empty()) return kept;
  kept.model = all.model;
  kept.cost = all.cost;
  kept.initial_q = all.initial_q;
  kept.initial_v = all.initial_v;
  kept.inputs = all.inputs;
  kept.input_end = all.input_end;
  kept.iterations = all.iterations;
  return kept;
}
inline PeriodicOrbitResult WhatTimeLeaves(const PeriodicOrbitResult& all) {
  PeriodicOrbitResult kept;
  if (all.iterations.empty()) return kept;
  kept.model = all.model;
  kept.iterations = all.iterations;
  kept.q = all.q;
  kept.v = all.v;
  kept.unknown_parameters = all.unknown_parameters;
  kept.parameters = all.parameters;
  kept.residual = all.residual;
  return kept;
}
/// … of a sweep the runs that were counted: the first ones.
inline EnsembleResult WhatTimeLeaves(const EnsembleResult& all) {
  return all.runs > 0 ? all : EnsembleResult();
}

template <class Result>
bool EndedByTime(const Result& result) {
  return result.outcome == kBudgetOutcome<Result> &&
         result.message.find("max_seconds = ") != std::string::npos;
}

/// … and of a motion all up to there, if it has begun.
inline ContactTrajectory WhatTimeLeaves(const ContactTrajectory& all) {
  return all.outcome == kBudgetOutcome<ContactTrajectory> && all.steps + all.rejected_steps > 0
             ? all
             : ContactTrajectory();
}

template <class Result>
void EndByTime(const std::string& sentence, Result* result) {
  const std::string told = result->message;
  *result = WhatTimeLeaves(*result);
  result->outcome = kBudgetOutcome<Result>;
  result->message = told.find("max_seconds = ") != std::string::npos ? told : sentence;
}

/// Runs `answer`, which returns a result, under the budget of this thread. Where that ends it the
/// result says so.
template <class Result, class Body>
void AnswerOrEnd(double max_megabytes, Result* result, const Body& answer) {
  try {
    *result = answer();
    const double size = 1e-6 * ros::serialization::serializationLength(*result);
    if (size > max_megabytes) {
      throw BudgetExceeded(BudgetEnd::kMegabytes,
                           "the answer takes " + std::to_string(size) +
                               " MB, max_megabytes = " + std::to_string(max_megabytes) +
                               " at most; ask for less in one answer");
    }
    // What came out well may hold parts that the budget has ended and that nobody looked at.
    const bool doubtful =
        result->outcome == 0 ? BudgetEndWasTold()
                             : !std::is_same_v<Result, ContactTrajectory>;  // it says what ended it
    std::string sentence;
    const BudgetEnd end = doubtful ? LookAtBudget(&sentence) : BudgetEnd::kNone;
    if (end == BudgetEnd::kCancelled && result->outcome == 0) throw BudgetExceeded(end, sentence);
    if (end == BudgetEnd::kSeconds || EndedByTime(*result)) EndByTime(sentence, result);
  } catch (const BudgetExceeded& reason) {
    *result = Result();
    result->outcome =
        reason.end() == BudgetEnd::kCancelled ? kCancelledOutcome : kBudgetOutcome<Result>;
    result->message = reason.what();
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
