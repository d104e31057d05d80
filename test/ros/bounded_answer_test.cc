// SPDX-License-Identifier: BSD-3-Clause
// An answer is called good only where no part of it was ended by its budget.
#include "src/ros/answer/bounded_answer.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <thread>

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr double kSeconds = 1e-3;
constexpr int kConverged = 0, kStalled = 2;

/// Until time is up, which it does not ask of the budget.
void UseUpTime() { std::this_thread::sleep_for(std::chrono::duration<double>(2 * kSeconds)); }

PeriodicOrbitResult Orbit(int outcome) {
  PeriodicOrbitResult orbit;
  orbit.outcome = static_cast<std::uint8_t>(outcome);
  orbit.model = "trot";
  orbit.iterations.resize(3);
  orbit.orbit.model = "trot";  // depends on when time ended
  return orbit;
}

template <class Result>
Result AnswerOf(const std::function<Result()>& body, const std::function<bool()>& cancelled = {}) {
  BudgetLimits limits;
  limits.max_seconds = kSeconds;
  limits.cancelled = cancelled;
  const Budget budget(limits);
  const BudgetScope scope(budget);
  Result result;
  AnswerOrEnd(1, &result, body);
  return result;
}

TEST(BoundedAnswer, OneWithAPartThatTimeHasEndedIsNotGood) {
  const auto result = AnswerOf<PeriodicOrbitResult>([] {
    UseUpTime();
    EXPECT_EQ(BudgetEnd::kSeconds, LookAtBudget(nullptr));  // by a run that nobody looks at
    return Orbit(kConverged);
  });
  EXPECT_EQ(kBudgetOutcome<PeriodicOrbitResult>, result.outcome);
  EXPECT_NE(std::string::npos, result.message.find("max_seconds = 0.001 ")) << result.message;
  EXPECT_EQ(3u, result.iterations.size());
  EXPECT_EQ("", result.orbit.model);
}

TEST(BoundedAnswer, SoIsARun) {
  const auto result = AnswerOf<ContactTrajectory>([] {
    UseUpTime();
    LookAtBudget(nullptr);
    ContactTrajectory run;
    run.model = "trot";
    return run;
  });
  EXPECT_EQ(kBudgetOutcome<ContactTrajectory>, result.outcome);
  EXPECT_EQ("", result.model);
}

TEST(BoundedAnswer, OneThatWasFinishedBeforeAnyoneWasToldIsGood) {
  const auto result = AnswerOf<PeriodicOrbitResult>([] {
    UseUpTime();
    return Orbit(kConverged);
  });
  EXPECT_EQ(kConverged, result.outcome);
  EXPECT_EQ("trot", result.orbit.model);
}

TEST(BoundedAnswer, WhatDidNotComeOutWellMayHaveLackedTime) {
  const auto result = AnswerOf<PeriodicOrbitResult>([] {
    UseUpTime();
    return Orbit(kStalled);
  });
  EXPECT_EQ(kBudgetOutcome<PeriodicOrbitResult>, result.outcome);
  EXPECT_EQ(3u, result.iterations.size());
}

TEST(BoundedAnswer, OneWithAPartThatWasCancelledIsCancelled) {
  const auto result = AnswerOf<PeriodicOrbitResult>(
      [] {
        EXPECT_EQ(BudgetEnd::kCancelled, LookAtBudget(nullptr));
        return Orbit(kConverged);
      },
      [] { return true; });
  EXPECT_EQ(kCancelledOutcome, result.outcome);
  EXPECT_EQ("", result.model);
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
