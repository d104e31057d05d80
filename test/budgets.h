// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <pthread.h>
#include <time.h>

#include <chrono>
#include <string>
#include <thread>

#include "contact_flow/budget.h"

/// How long it takes to be told that a budget is used up, for tests.
namespace contact_flow {
namespace test {

/// Longest from the end of a budget to the answer [s of the processor]: what is promised, though it
/// takes milliseconds alone.
constexpr double kPromise = 1;

/// Time of the processor [s] that one thread has used: what other programs use does not count.
class ThreadClock {
 public:
  /// Of the thread that makes it.
  ThreadClock() { pthread_getcpuclockid(pthread_self(), &clock_); }
  double Now() const {
    timespec now;
    clock_gettime(clock_, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }

 private:
  clockid_t clock_;
};

struct Ended {
  BudgetEnd end = BudgetEnd::kNone;  ///< that `body` threw
  std::string message;
  double seconds = 0;  ///< of the processor
};

template <class Body>
Ended RunWithin(const Budget& budget, const Body& body) {
  Ended ended;
  const BudgetScope scope(budget);
  const ThreadClock clock;
  const double begin = clock.Now();
  try {
    body();
  } catch (const BudgetExceeded& reason) {
    ended.end = reason.end();
    ended.message = reason.what();
  }
  ended.seconds = clock.Now() - begin;
  return ended;
}

template <class Body>
Ended RunWithin(const BudgetLimits& limits, const Body& body) {
  return RunWithin(Budget(limits), body);
}

inline BudgetLimits Seconds(double seconds) {
  BudgetLimits limits;
  limits.max_seconds = seconds;
  return limits;
}

inline BudgetLimits Megabytes(double megabytes) {
  BudgetLimits limits;
  limits.max_megabytes = megabytes;
  return limits;
}

/// `body` takes long: it ends, by exception, with its seconds, wherever it is then, and when
/// it is cancelled.
template <class Body>
void ExpectEndsInTime(const Body& body, std::initializer_list<double> budgets) {
  for (const double seconds : budgets) {
    const Ended ended = RunWithin(Seconds(seconds), body);
    EXPECT_EQ(ended.end, BudgetEnd::kSeconds) << seconds << " s: " << ended.message;
    EXPECT_LT(ended.seconds, seconds + kPromise) << ended.message;
    EXPECT_NE(ended.message.find("max_seconds = "), std::string::npos) << ended.message;
    EXPECT_NE(ended.message.find("ended in: "), std::string::npos) << ended.message;
  }
  const Budget budget(Seconds(100));
  const ThreadClock clock;
  const double begin = clock.Now();
  double told = 0;
  std::thread other([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    told = clock.Now() - begin;
    budget.Cancel("cancelled by the test");
  });
  const Ended ended = RunWithin(budget, body);
  other.join();
  EXPECT_EQ(ended.end, BudgetEnd::kCancelled);
  EXPECT_LT(ended.seconds, told + kPromise);
  EXPECT_EQ(ended.message.find("cancelled by the test"), 0u) << ended.message;
}

}  // namespace test
}  // namespace contact_flow
