// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "contact_flow/nearest_name.h"
#include "src/ros/answer/bounded_answer.h"
#include "src/ros/answer/watch.h"
#include "src/ros/recording/outlet.h"
#include "src/session/setup.h"
#include "stopping.h"
#include "work_pool.h"

/// What the handlers of services and actions have in common.
namespace contact_flow {
namespace ros_interface {

/// Longer messages of refusals are cut [bytes].
inline constexpr std::size_t kLongestMessage = 2000;
/// As asked, or the node's where that is 0 or out of range, which is refused later.
inline BudgetLimits LimitsOf(const Setup& setup, const SimulationOptions& asked) {
  const auto limit = [](double value, double standard, double largest) {
    return value > 0 && value <= largest ? value : standard;
  };
  BudgetLimits limits;
  limits.max_seconds = limit(asked.max_seconds, setup.options.max_seconds, kMaxSeconds);
  limits.max_megabytes = limit(asked.max_megabytes, setup.options.max_megabytes, kMaxMegabytes);
  limits.cancelled = &IsStopping;
  return limits;
}

/// Runs `answer`, which returns a result, as work of the pool. Where its budget ends it the result
/// says so (bounded_answer.h).
template <class Response, class Result, class Body>
void AnswerWithin(WorkPool* pool, const char* service, BudgetLimits limits, Result* result,
                  const Body& answer) {
  static_assert(Response::BUDGET_EXCEEDED == kBudgetOutcome<Result> &&
                Response::CANCELLED == kCancelledOutcome);
  const double most = std::min(limits.max_megabytes, kLargestAnswer);
  const auto work = pool->Begin(service, std::move(limits), "the node was stopped");
  if constexpr (std::is_same_v<Result, EnsembleResult>) work->CountAsLong();
  const BudgetScope scope(work->budget());
  AnswerOrEnd(most, result, answer);
  work->ThrowIfRefused();
}

/// Runs a handler's body: what it throws is the answer, with success = false.
template <class Response, class Body>
bool Guard(const char* service, Response* out, const Body& body) {
  try {
    body();
    out->success = true;
  } catch (const std::bad_alloc&) {
    out->success = false;
    out->message = "out of memory: the node may take what ~max_memory says, see docs/limits.md";
  } catch (const std::exception& error) {
    out->success = false;
    out->message = Cut(error.what(), kLongestMessage);
  } catch (...) {
    out->success = false;
    out->message = "unknown error";
  }
  if (!out->success) ROS_WARN("%s: %s", service, out->message.c_str());
  return true;
}

/// Records and publishes a result. Not being able to record what was to be recorded is a failure,
/// but the result is answered all the same.
template <class Record, class Response>
void Deliver(Outlet* outlet, Record* record, Response* out) {
  out->outcome = record->result.outcome;
  out->message = record->result.message;
  out->warnings = record->result.warnings;
  try {
    out->recorded = outlet->Deliver(record);
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string("NOT RECORDED: ") + error.what() +
                             "; the result itself is complete");
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
