// SPDX-License-Identifier: BSD-3-Clause
// The loader on damaged robots, under AddressSanitizer and UndefinedBehaviorSanitizer, for
// CONTACT_FLOW_FUZZ_SECONDS (20). CONTACT_FLOW_FUZZ_SEED (1) chooses the inputs; what fails or
// hangs is left in fuzz_finding.txt of the working directory and is tried again by
// CONTACT_FLOW_FUZZ_INPUT=fuzz_finding.txt.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/time.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "test/fuzz/mutation.h"
#include "test/fuzz/robot_input.h"
#include "test/model/robots.h"

extern "C" void __sanitizer_set_death_callback(void (*callback)());
/// abort() and terminate() are findings, too.
extern "C" const char* __asan_default_options() {
  return "handle_abort=1:allocator_may_return_null=1";
}

namespace contact_flow {
namespace fuzz {
namespace {

/// Longest that one input may take [s], under sanitizers on a busy machine.
constexpr unsigned kMaxSeconds = 20;
/// Longest input that is made; the seeds alone are longer.
constexpr std::size_t kMaxSize = 100000;

const std::string* current = nullptr;

void LeaveFinding() {
  if (current == nullptr) return;
  std::FILE* file = std::fopen("fuzz_finding.txt", "wb");
  if (file == nullptr) return;
  std::fwrite(current->data(), 1, current->size(), file);
  std::fclose(file);
  std::fputs("the input is in fuzz_finding.txt\n", stderr);
}

void TakesTooLong(int) {
  std::fprintf(stderr, "FINDING: an input takes more than %u s\n", kMaxSeconds);
  LeaveFinding();
  _exit(1);
}

bool Try(const std::string& input) {
  current = &input;
  alarm(kMaxSeconds);
  const bool accepted = Load(input);
  alarm(0);
  current = nullptr;
  return accepted;
}

long Number(const char* variable, long otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::atol(text);
}

class Fuzz : public testing::Test {
 protected:
  void SetUp() override {
    __sanitizer_set_death_callback(&LeaveFinding);
    signal(SIGALRM, &TakesTooLong);
  }
};

TEST_F(Fuzz, SeedsAreReadOrRefused) {
  std::size_t accepted = 0;
  for (const std::string& seed : Seeds()) accepted += Try(seed);
  EXPECT_EQ(AllRobots().size(), accepted);  // the robots themselves
}

TEST_F(Fuzz, DamagedRobotsAreReadOrRefused) {
  if (const char* path = std::getenv("CONTACT_FLOW_FUZZ_INPUT")) {
    std::ifstream file(path);
    std::stringstream text;
    text << file.rdbuf();
    std::printf("%s: %s\n", path, Try(text.str()) ? "accepted" : "refused");
    return;
  }
  const long seconds = Number("CONTACT_FLOW_FUZZ_SECONDS", 20),
             seed = Number("CONTACT_FLOW_FUZZ_SEED", 1);
  std::vector<std::string> corpus;
  for (const std::string& text : Seeds()) {
    if (text.size() <= kMaxSize) corpus.push_back(text);
  }
  std::mt19937 generator(static_cast<unsigned>(seed));
  Mutator mutator(&generator);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
  const std::size_t kept = corpus.size();
  long tried = 0, accepted = 0;
  while (std::chrono::steady_clock::now() < end) {
    const std::string input = mutator.Mutate(corpus, kMaxSize);
    ++tried;
    if (!Try(input)) continue;
    ++accepted;
    // Damage adds up in robots that still load.
    if (corpus.size() < kept + 64) {
      corpus.push_back(input);
    } else {
      corpus[kept + generator() % 64] = input;
    }
  }
  std::printf("seed %ld: %ld inputs in %ld s, %ld of them accepted, no finding\n", seed, tried,
              seconds, accepted);
  RecordProperty("inputs", static_cast<int>(tried));
  EXPECT_GT(tried, 0);
  EXPECT_LT(accepted, tried);
}

}  // namespace
}  // namespace fuzz
}  // namespace contact_flow
