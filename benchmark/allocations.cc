// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>

#include "allocation_count.h"
#include "contact_flow/flow/simulate.h"
#include "sections.h"

namespace contact_flow {
namespace benchmark {
namespace {

struct Count {
  long steps, events, allocations;
};

Count CountAllocations(const Scenario& scenario, const SimulateOptions& options) {
  const long before = AllocationCount();
  const Trajectory trajectory =
      Simulate(*scenario.system, scenario.x, scenario.u, scenario.duration, options);
  const long after = AllocationCount();
  return {trajectory.statistics.steps, static_cast<long>(trajectory.transitions.size()),
          after - before};
}

}  // namespace

void ReportAllocations(const Scenario& scenario, Requirements* requirements) {
  std::printf("\nHeap allocations of a run, scenario %s\n", scenario.name.c_str());
  if (AllocationCount() < 0) {
    std::printf("  SKIPPED: they are counted with glibc only\n");
    return;
  }
  for (bool dense : {false, true}) {
    SimulateOptions options;
    options.dense = dense;
    options.relative_tolerance = options.absolute_tolerance = 1e-9;
    const Count few = CountAllocations(scenario, options);
    options.relative_tolerance = options.absolute_tolerance = 1e-14;
    options.max_step = scenario.duration / (4.0 * static_cast<double>(few.steps));
    const Count many = CountAllocations(scenario, options);
    const double per_step = static_cast<double>(many.allocations - few.allocations) /
                            static_cast<double>(many.steps - few.steps);
    std::printf("  %-14s %ld steps, %ld events: %ld;  %ld steps, %ld events: %ld;  per step %.2f\n",
                dense ? "dense output" : "plain", few.steps, few.events, few.allocations,
                many.steps, many.events, many.allocations, per_step);
    if (!dense) {
      requirements->AtMost(scenario.name + ", heap allocations per step", std::abs(per_step), 0);
    }
  }
}

}  // namespace benchmark
}  // namespace contact_flow
