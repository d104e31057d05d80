// SPDX-License-Identifier: BSD-3-Clause
// Hostile requests of every service, action and command, answered in this process, for
// CONTACT_FLOW_FUZZ_SECONDS (60) or, if given, CONTACT_FLOW_FUZZ_COUNT requests, from
// CONTACT_FLOW_FUZZ_SEED (1) on. Each request has a seed of its own, which a finding names:
// CONTACT_FLOW_FUZZ_SEED=… CONTACT_FLOW_FUZZ_COUNT=1 tries that one alone on a new target.
#include <gtest/gtest.h>
#include <ros/console.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "test/fuzz/request_target.h"

/// abort() and terminate() are findings, too.
extern "C" const char* __asan_default_options() {
  return "handle_abort=1:allocator_may_return_null=1";
}

namespace contact_flow {
namespace fuzz {
namespace {

/// Longest that one request may take [s], under sanitizers on a busy machine.
constexpr unsigned kMaxSeconds = 60;

std::string asked;   // what is being answered
unsigned long seed;  // of it

void Tell(int signal) {
  std::fprintf(stderr, "FINDING: %s at seed %lu of\n%.2000s\n",
               signal == SIGALRM ? "an answer takes too long" : strsignal(signal), seed,
               asked.c_str());
  ::signal(signal, SIG_DFL);
  if (signal == SIGALRM) _exit(1);
  raise(signal);
}

long Number(const char* variable, long otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::atol(text);
}

TEST(RequestFuzz, HostileRequestsAreAnsweredOrRefused) {
  for (const int signal : {SIGALRM, SIGABRT, SIGSEGV, SIGFPE, SIGILL, SIGBUS}) {
    ::signal(signal, &Tell);
  }
  if (ros::console::set_logger_level(ROSCONSOLE_DEFAULT_NAME, ros::console::levels::Fatal)) {
    ros::console::notifyLoggerLevelsChanged();
  }
  const long seconds = Number("CONTACT_FLOW_FUZZ_SECONDS", 60),
             most = Number("CONTACT_FLOW_FUZZ_COUNT", -1);
  seed = static_cast<unsigned long>(Number("CONTACT_FLOW_FUZZ_SEED", 1));
  std::vector<RequestTarget> targets;
  for (const char* model : {"soft_biped", "rigid_biped", "falling_box", "double_pendulum"}) {
    targets.emplace_back(model);
  }
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
  long tried = 0, answered = 0;
  double slowest = 0;
  std::string slow;
  while (most >= 0 ? tried < most : std::chrono::steady_clock::now() < end) {
    std::mt19937 generator(static_cast<unsigned>(seed));
    RequestTarget& target = targets[generator() % targets.size()];
    const auto begin = std::chrono::steady_clock::now();
    alarm(kMaxSeconds);
    answered += target.TryOne(&generator, &asked) == RequestTarget::Result::kAnswered;
    target.GoOn();
    if (tried % 200 == 0) target.CheckGood();
    alarm(0);
    const double took =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (took > slowest) {
      slowest = took;
      slow = asked;
    }
    ++tried;
    ++seed;
  }
  std::printf("%ld hostile requests: %ld answered, %ld refused; the slowest took %.2f s\n%.600s\n",
              tried, answered, tried - answered, slowest, slow.c_str());
  RecordProperty("requests", static_cast<int>(tried));
  EXPECT_GT(tried, 0);
}

}  // namespace
}  // namespace fuzz
}  // namespace contact_flow
