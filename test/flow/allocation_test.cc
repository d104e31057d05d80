// SPDX-License-Identifier: BSD-3-Clause
// A run allocates for what it keeps (arcs, transitions), never for a step.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"
#include "test/model/robots.h"

#if defined(CONTACT_FLOW_SANITIZED) || defined(__SANITIZE_ADDRESS__) || \
    defined(__SANITIZE_THREAD__) || !defined(__GLIBC__)
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

#if COUNTS_ALLOCATIONS

/// Runs of few and of many steps through the same events allocate the same number of times.
void ExpectNoneForAStep(const MechanicalSystem& system, const Vector& x) {
  const auto count = [&](double tolerance, long* steps) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    options.dense = false;
    options.simultaneity_tolerance = 1e-7;  // both runs merge the same events
    const long before = allocations;
    const Trajectory run =
        Simulate(system, x, system.nominal().u, system.nominal().duration, options);
    *steps = run.statistics.steps;
    return allocations - before;
  };
  long few = 0, many = 0;
  const long loose = count(1e-4, &few), tight = count(1e-13, &many);
  EXPECT_GT(many, few);
  EXPECT_GT(loose, 0) << "the counter counts";
  EXPECT_EQ(loose, tight) << system.description().name << ": " << few << " and " << many
                          << " steps";
}

TEST(Allocation, NoneForAStep) {
  for (const char* name : {"soft_biped", "hopping_trot", "rigid_biped", "double_pendulum"}) {
    const auto system = MakeModel(name);
    Vector x = system->nominal().x;
    x(2) += 0.01;  // rigid_biped lands foot by foot
    ExpectNoneForAStep(*system, x);
  }
}

TEST(Allocation, NoneForAStepOfARobot) {
  for (const char* name : {"monoped", "soft_biped", "quadruped"}) {
    const auto system = LoadRobot(RobotFile(name));
    ExpectNoneForAStep(*system, system->nominal().x);
  }
}

TEST(Allocation, NoneForAJacobianOfARobot) {
  for (const std::string& name : AllRobots()) {
    const auto system = LoadRobot(RobotFile(name));
    const Vector& x = system->nominal().x;
    ContactDynamics dynamics(*system, system->nominal().u);
    const ContactMode mode({0, 1});
    dynamics.Differentiate(x, mode);  // makes room
    const long before = allocations;
    dynamics.Differentiate(x, mode);
    EXPECT_EQ(before, allocations) << name;
  }
}

#endif

}  // namespace
}  // namespace contact_flow
#undef COUNTS_ALLOCATIONS
