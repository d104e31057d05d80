// SPDX-License-Identifier: BSD-3-Clause
// Hostile requests of every service, action and command, answered in this process, for
// CONTACT_FLOW_FUZZ_SECONDS (20) or, if given, CONTACT_FLOW_FUZZ_COUNT requests, from
// CONTACT_FLOW_FUZZ_SEED (1) on. Each request has a seed of its own, which a finding names:
// CONTACT_FLOW_FUZZ_SEED=… CONTACT_FLOW_FUZZ_COUNT=1 tries that one alone on a new target, and
// shows all of it.
#include <gtest/gtest.h>
#include <ros/console.h>
#include <signal.h>
#include <string.h>
#include <time.h>  // clock_gettime
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
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

/// Longest that one request may take [s], by the clock, on a machine that gives it a hundredth.
constexpr unsigned kMaxSeconds = 600;
#ifdef __SANITIZE_ADDRESS__
constexpr double kBetweenQuestions = 10;  // [s]
#else
constexpr double kBetweenQuestions = 1;  // [s]
#endif

Asked asked;         // what is being answered
unsigned long seed;  // of it

/// Processor time of this thread [s]: other processes of the machine are no part of it.
double Processor() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The most memory that this process has held so far [MB].
double MostResident() {
  std::ifstream status("/proc/self/status");
  std::string word;
  double kilobytes = 0;
  while (status >> word) {
    if (word == "VmHWM:") status >> kilobytes;
  }
  return 1e-3 * kilobytes;
}

/// Keeps a request for test/data/fuzz.
void Save(const char* why) {
  const std::string name =
      asked.model + "." + asked.wire.kind + "." + why + "_" + std::to_string(seed) + ".bin";
  if (std::FILE* file = std::fopen(name.c_str(), "wb")) {
    std::fwrite(asked.wire.bytes.data(), 1, asked.wire.bytes.size(), file);
    std::fclose(file);
    std::fprintf(stderr, "kept as %s\n", name.c_str());
  }
}

void Tell(int signal) {
  std::fprintf(stderr, "FINDING: %s at seed %lu of\n%.2000s\n",
               signal == SIGALRM ? "an answer takes too long" : strsignal(signal), seed,
               asked.text.c_str());
  ::signal(signal, SIG_DFL);
  Save("finding");
  if (signal == SIGALRM) _exit(1);
  raise(signal);
}

long Number(const char* variable, long otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::atol(text);
}

/// The models, with what is known to have been a finding once.
std::vector<RequestTarget> Targets() {
  for (const int signal : {SIGALRM, SIGABRT, SIGSEGV, SIGFPE, SIGILL, SIGBUS}) {
    ::signal(signal, &Tell);
  }
  if (ros::console::set_logger_level(ROSCONSOLE_DEFAULT_NAME, ros::console::levels::Fatal)) {
    ros::console::notifyLoggerLevelsChanged();
  }
  std::vector<RequestTarget> targets;
  for (const char* model : {"soft_biped", "rigid_biped", "falling_box", "double_pendulum",
                            "block_on_incline", "puck", "compass_walker", "driven_ball"}) {
    targets.emplace_back(model);
    targets.back().ReadCorpus(CONTACT_FLOW_TEST_DATA "/fuzz");
  }
  return targets;
}

/// The slowest so far.
struct Slowest {
  double seconds = 0;
  std::string text;
  /// Requests may take kSeconds and what lies between two questions for the budget: a second, as
  /// promised, ten times as much under sanitizers.
  void Note(double took) {
    if (took <= seconds) return;
    seconds = took;
    text = asked.text;
    if (took <= RequestTarget::kSeconds + kBetweenQuestions) return;
    Save("slow");
    ADD_FAILURE() << took << " s at seed " << seed << " of\n" << text.substr(0, 2000);
  }
};

TEST(RequestFuzz, FormerFindingsAreAnsweredOrRefused) {
  std::vector<RequestTarget> targets = Targets();
  std::size_t tried = 0;
  Slowest slowest;
  for (RequestTarget& target : targets) {
    for (std::size_t k = 0; k < target.CorpusSize(); ++k, ++tried) {
      const double begin = Processor();
      alarm(kMaxSeconds);
      target.TryCorpus(k, &asked);
      target.GoOn();
      target.CheckGood();
      alarm(0);
      slowest.Note(Processor() - begin);
    }
  }
  std::printf("%zu former findings, the slowest took %.2f s\n", tried, slowest.seconds);
  std::size_t kept = 0;
  for (const auto& entry : std::filesystem::directory_iterator(CONTACT_FLOW_TEST_DATA "/fuzz")) {
    kept += entry.path().extension() == ".bin";
  }
  EXPECT_EQ(tried, kept) << "findings of models that are not among these";
}

TEST(RequestFuzz, HostileRequestsAreAnsweredOrRefused) {
  const long seconds = Number("CONTACT_FLOW_FUZZ_SECONDS", 20),
             most = Number("CONTACT_FLOW_FUZZ_COUNT", -1);
  seed = static_cast<unsigned long>(Number("CONTACT_FLOW_FUZZ_SEED", 1));
  asked.at_length = most == 1;
  std::vector<RequestTarget> targets = Targets();
  const auto begin = std::chrono::steady_clock::now(), end = begin + std::chrono::seconds(seconds);
  long tried = 0, answered = 0, good = 0;
  Slowest slowest;
  while (most >= 0 ? tried < most : std::chrono::steady_clock::now() < end) {
    std::mt19937 generator(static_cast<unsigned>(seed));
    RequestTarget& target = targets[generator() % targets.size()];
    const double before = Processor();
    alarm(kMaxSeconds);
    answered += target.TryOne(&generator, &asked) == RequestTarget::Result::kAnswered;
    slowest.Note(Processor() - before);
    target.GoOn();
    if (tried % 200 == 0) {
      target.CheckGood();
      ++good;
    }
    alarm(0);
    ++tried;
    ++seed;
  }
  const double all =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::printf(
      "%ld hostile requests in %.0f s: %ld answered, %ld refused; %ld good ones in between; "
      "resident at most %.0f MB; the slowest took %.2f s of processor time\n%.600s\n",
      tried, all, answered, tried - answered, good, MostResident(), slowest.seconds,
      slowest.text.c_str());
  RecordProperty("requests", static_cast<int>(tried));
  EXPECT_GT(tried, 0);
}

}  // namespace
}  // namespace fuzz
}  // namespace contact_flow
