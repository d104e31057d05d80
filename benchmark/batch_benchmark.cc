// SPDX-License-Identifier: BSD-3-Clause
//
//   batch_benchmark [runs] [rounds]
//
// Trots from starts around those of trot_benchmark, on one core: a loop over Simulate (dense =
// false) and SimulateBatch by 4 and by 8 lanes, in turns. Processor time, the least of all rounds.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <limits>
#include <random>
#include <string>

#include "contact_flow/flow/simulate_batch.h"
#include "requirements.h"
#include "scenario.h"

namespace contact_flow {
namespace benchmark {
namespace {

constexpr double kSpread = 0.01;   // of the starts, standard deviation
constexpr double kLeastRatio = 3;  // of rates
constexpr double kTolerance = 1e-9;

double Seconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

bool SameBits(const Vector& a, const Vector& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())) == 0;
}

void Report(const Scenario& scenario, int runs, int rounds, Requirements* requirements) {
  Matrix states(kStates, runs), ends(kStates, runs);
  std::mt19937 generator(1);
  std::normal_distribution<double> normal(0, kSpread);
  for (int k = 0; k < runs; ++k) {
    states.col(k) = scenario.x;
    for (double& number : states.col(k)) number += normal(generator);
  }
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = kTolerance;
  options.dense = false;
  const LaneSet sets[] = {LaneSet::kAvx2, LaneSet::kAvx512};
  double single = std::numeric_limits<double>::infinity(), lanes[2] = {single, single};
  BatchResult results[2];
  for (int round = 0; round < rounds; ++round) {
    double begin = Seconds();
    for (int k = 0; k < runs; ++k) {
      ends.col(k) =
          Simulate(*scenario.system, states.col(k), scenario.u, scenario.duration, options)
              .FinalState();
    }
    single = std::min(single, Seconds() - begin);
    for (int set = 0; set < 2; ++set) {
      results[set] = BatchResult();
      BatchOptions batch;
      batch.lanes = sets[set];
      begin = Seconds();
      results[set] =
          SimulateBatch(*scenario.system, states, scenario.u, scenario.duration, options, batch);
      lanes[set] = std::min(lanes[set], Seconds() - begin);
    }
  }
  std::printf("%s, %d trots [us a trot]\n  one after the other %8.2f\n", scenario.about.c_str(),
              runs, 1e6 * single / runs);
  for (int set = 0; set < 2; ++set) {
    const BatchResult& batch = results[set];
    if (batch.width == 1) {
      std::printf("  no lanes: %s\n", batch.why.c_str());
      continue;
    }
    long others = 0;
    for (int k = 0; k < runs; ++k) {
      others += !SameBits(batch.runs[static_cast<std::size_t>(k)].final_state, ends.col(k));
    }
    std::printf(
        "  %d lanes             %8.2f   %.2f times the rate, %ld runs alone, %ld with "
        "other bits\n",
        batch.width, 1e6 * lanes[set] / runs, single / lanes[set], batch.alone, others);
    requirements->AtMost(scenario.name + ": a trot in " + std::to_string(batch.width) +
                             " lanes, in those of Simulate",
                         lanes[set] / single, 1 / kLeastRatio);
    requirements->AtMost(
        scenario.name + ": trots with other bits in " + std::to_string(batch.width) + " lanes",
        static_cast<double>(others), 0);
  }
}

}  // namespace
}  // namespace benchmark
}  // namespace contact_flow

int main(int argc, char** argv) {
  namespace benchmark = contact_flow::benchmark;
  const int runs = argc > 1 ? std::atoi(argv[1]) : 10000;
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 5;
  benchmark::Requirements requirements;
  benchmark::Report(benchmark::TiltedTrot(), runs, rounds, &requirements);
  benchmark::Report(benchmark::OscillatingTrot(), runs, rounds, &requirements);
  requirements.Print();
  return 0;
}
