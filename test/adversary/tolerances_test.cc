// SPDX-License-Identifier: BSD-3-Clause
// One motion in extreme units of time, and by tolerances that differ from each other, is one.
#include <gtest/gtest.h>

#include <string>

#include "contact_flow/flow/simulate.h"
#include "test/adversary/generator.h"
#include "test/adversary/trial.h"

namespace contact_flow {
namespace adversary {
namespace {

constexpr double kSameMotion = 1e-6;

double Apart(const Vector& a, const Vector& b) {
  return (a - b).cwiseAbs().maxCoeff() / (1 + b.cwiseAbs().maxCoeff());
}

/// Four contacts land at once, all are let off by their accelerations, and one comes back after
/// 6 ms; in a system whose second lasts 1.2e-7 s.
TEST(ExtremeUnits, AreThoseOfTheStep) {
  const Case given = Generate(46502);
  Case plain = given;
  plain.units = Units::Same(given.system->dof(), given.system->num_constraints());
  const Trajectory here = Trial(given).Simulated(0), there = Trial(plain).Simulated(0);
  ASSERT_TRUE(here.status.ok() && there.status.ok());
  EXPECT_LT(Apart(given.units.Back(here.FinalState()), there.FinalState()), kSameMotion);
  EXPECT_EQ(here.transitions.size(), there.transitions.size());
}

Trajectory Moved(const Case& c, double absolute) {
  SimulateOptions options;
  options.relative_tolerance = 1e-9;
  options.absolute_tolerance = absolute;
  options.impact_law = c.options.impact_law;
  return Simulate(*c.system, c.x, c.schedule, c.duration, options);
}

/// Where the absolute tolerance is far below the relative one, contacts that land together are
/// further from their surfaces than it: they have touched all the same. One that is let off from
/// there is not held by the next impact.
TEST(AbsoluteTolerance, BelowTheRelativeOneGrazesNothing) {
  for (std::uint64_t seed : {939, 1248, 2940, 2950}) {
    const Case c = Generate(seed);
    const Trajectory usual = Moved(c, 1e-9), low = Moved(c, 1e-12);
    ASSERT_TRUE(usual.status.ok() && low.status.ok()) << "seed " << seed;
    EXPECT_LT(Apart(low.FinalState(), usual.FinalState()), kSameMotion) << "seed " << seed;
    for (const Transition& transition : low.transitions) {
      EXPECT_TRUE(transition.grazed.Empty()) << "seed " << seed << ", t = " << transition.t;
    }
  }
}

}  // namespace
}  // namespace adversary
}  // namespace contact_flow
