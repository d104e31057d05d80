// SPDX-License-Identifier: BSD-3-Clause
//
//   sweep_benchmark [runs] [threads] [statistics|columns] [rounds]
//
// Trots of the wide hopping_trot, pitch and pitch rate drawn: the bare loop over Simulate on one
// thread and Sweep on `threads`, one run at a time and in lanes, by turns. Processor time of a run
// tells what the sweep adds to the loop, whatever else the machine does; time by the clock what it
// does on idle cores.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "contact_flow/ensemble/sweep.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

struct Times {
  double processor, clock;
};

double Seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

template <class Work>
Times Measure(Work&& work) {
  rusage before, after;
  getrusage(RUSAGE_SELF, &before);
  const auto begin = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double> clock = std::chrono::steady_clock::now() - begin;
  getrusage(RUSAGE_SELF, &after);
  return {Seconds(after.ru_utime) + Seconds(after.ru_stime) - Seconds(before.ru_utime) -
              Seconds(before.ru_stime),
          clock.count()};
}

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

int Run(std::uint64_t runs, int threads, bool columns, int rounds) {
  SweepRequest request;
  request.system = MakeModel("hopping_trot", {});
  request.x = request.system->nominal().x;
  request.inputs = InputSchedule::Constant(request.system->nominal().u);
  request.duration = request.system->nominal().duration;
  request.count = runs;
  request.threads = threads;
  request.keep.final_state = request.keep.outcome = request.keep.words = columns;
  DrawPart part;
  part.names = {"body_pitch", "d/dt body_pitch"};
  part.low = Eigen::Vector2d(-0.2, -0.5);
  part.high = -part.low;
  request.draws.parts = {part};

  const Sampler sampler(request.draws);
  const StartMap map(*request.system, sampler.names(), request.x, request.inputs.values[0]);
  SimulateOptions options;
  options.dense = false;
  double sum = 0;
  std::vector<double> bare, swept, ratio, clocks, lanes, lane_ratio, lane_clocks;
  for (int round = 0; round < rounds; ++round) {
    const Times loop = Measure([&] {
      Vector values;
      RunStart start;
      for (std::uint64_t run = 0; run < runs; ++run) {
        sampler.Draw(run, &values);
        map.Apply(values, &start);
        sum +=
            Simulate(*request.system, start.x, start.u, request.duration, options).FinalState()(6);
      }
    });
    request.lanes = LaneSet::kNone;
    const Times sweep = Measure([&] { sum += Sweep(request).reference(0); });
    request.lanes = LaneSet::kBest;
    const Times in_lanes = Measure([&] { sum += Sweep(request).reference(0); });
    lanes.push_back(in_lanes.processor);
    lane_ratio.push_back(loop.processor / in_lanes.processor);
    lane_clocks.push_back(in_lanes.clock);
    bare.push_back(loop.processor);
    swept.push_back(sweep.processor);
    ratio.push_back(loop.processor / sweep.processor);
    clocks.push_back(sweep.clock);
  }
  const auto n = static_cast<double>(runs);
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  std::printf("bare loop        %8.2f us of processor a trot\n", 1e6 * Median(bare) / n);
  std::printf("sweep, %d threads %8.2f us of processor a trot\n", threads, 1e6 * Median(swept) / n);
  std::printf("efficiency       %8.4f by processor time, median of %d rounds\n", Median(ratio),
              rounds);
  std::printf("by the clock     %8.0f trots/s\n", n / Median(clocks));
  std::printf("in lanes         %8.2f us, %.2f of the loop's rate, %.0f trots/s by the clock\n",
              1e6 * Median(lanes) / n, Median(lane_ratio), n / Median(lane_clocks));
  std::printf("largest memory   %8.1f MB   (%g)\n", 1e-3 * static_cast<double>(usage.ru_maxrss),
              sum);
  return 0;
}

}  // namespace
}  // namespace contact_flow

int main(int argc, char** argv) {
  const auto number = [&](int k, long usual) { return argc > k ? std::atol(argv[k]) : usual; };
  const bool columns = argc > 3 && std::strcmp(argv[3], "columns") == 0;
  return contact_flow::Run(static_cast<std::uint64_t>(number(1, 50000)),
                           static_cast<int>(number(2, 2)), columns, static_cast<int>(number(4, 5)));
}
