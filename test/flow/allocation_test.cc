// SPDX-License-Identifier: BSD-3-Clause
// A run allocates for what it keeps (arcs, transitions), never for a step.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__GLIBC__)
#define COUNTS_ALLOCATIONS 0
#else
#define COUNTS_ALLOCATIONS 1
static std::atomic<long> allocations{0};
extern "C" void* __libc_malloc(std::size_t);
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
#endif

namespace contact_flow {
namespace {

TEST(Allocation, NoneForAStep) {
#if COUNTS_ALLOCATIONS
  for (const char* name : {"soft_biped", "hopping_trot", "rigid_biped", "double_pendulum"}) {
    const auto system = MakeModel(name);
    Vector x = system->nominal().x;
    x(2) += 0.01;  // rigid_biped lands foot by foot
    const auto count = [&](double tolerance, long* steps) {
      SimulateOptions options;
      options.relative_tolerance = options.absolute_tolerance = tolerance;
      options.dense = false;
      const long before = allocations;
      const Trajectory run = Simulate(*system, x, system->nominal().u,
                                      system->nominal().duration, options);
      *steps = run.statistics.steps;
      return allocations - before;
    };
    long few = 0, many = 0;
    const long loose = count(1e-4, &few), tight = count(1e-13, &many);
    EXPECT_GT(many, few);
    EXPECT_GT(loose, 0) << "the counter counts";
    EXPECT_EQ(loose, tight) << name << ": " << few << " and " << many << " steps";
  }
#else
  std::puts("allocations are not counted under a sanitizer or without glibc");
#endif
}

}  // namespace
}  // namespace contact_flow
