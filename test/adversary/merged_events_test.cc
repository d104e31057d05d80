// SPDX-License-Identifier: BSD-3-Clause
// Events that a run merges as its errors do not tell their order: whatever that order is, the
// answer says from where on its derivative holds.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/cluster_reading.h"
#include "test/adversary/draw.h"
#include "test/adversary/generator.h"

namespace contact_flow {
namespace adversary {
namespace {

Trajectory RunAt(const Case& c, const RescaledSystem& system, double tolerance,
                 IntegrationMethod method) {
  SimulateOptions options;
  options.absolute_tolerance = tolerance;
  options.impact_law = c.options.impact_law;
  options = c.units.Scale(options);
  options.relative_tolerance = tolerance;
  options.method = method;
  return Simulate(system, c.units.State(c.x), c.schedule, c.duration * c.units.time, options);
}

double Largest(const Vector& x) { return x.cwiseAbs().maxCoeff(); }

/// Two and three touchdowns some 1e-12 s apart, told apart at 1e-13 alone.
TEST(MergedEvents, SayFromWhereOnTheirOrderHolds) {
  constexpr double kWrong = 1e-6;
  int merged = 0, wrong = 0;
  for (const std::uint64_t seed : {300917, 310025}) {
    const Case c = Generate(seed);
    ASSERT_TRUE(c.skipped.empty());
    const RescaledSystem system(*c.system, c.units);
    const Trajectory fine = RunAt(c, system, 1e-13, IntegrationMethod::kExplicit);
    const BDerivative told = DifferentiateOutcome(system, fine);
    ASSERT_TRUE(told.status.ok()) << told.status.message;
    for (const double tolerance : {1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11}) {
      for (const auto method : {IntegrationMethod::kExplicit, IntegrationMethod::kImplicit}) {
        const Trajectory run = RunAt(c, system, tolerance, method);
        const BDerivative B = DifferentiateOutcome(system, run);
        if (!B.status.ok()) continue;
        merged += run.transitions.size() < fine.transitions.size();
        Draw draw(seed);
        for (int k = 0; k < 10; ++k) {
          Vector w(2 * system.dof());
          for (double& entry : w) entry = draw.Normal();
          w = ProjectAdmissible(system, c.units.State(c.x), told.initial_mode, c.units.State(w));
          const Vector exact = c.units.Back(told(w));
          const double off = Largest(c.units.Back(B(w)) - exact) / (1 + Largest(exact));
          if (!(off > kWrong)) continue;
          ++wrong;
          EXPECT_GT(ReadClusters(B, w).inner_radius + ReadClusters(told, w).inner_radius, 0)
              << "seed " << seed << ", tolerance " << tolerance << ", off by " << off;
        }
      }
    }
  }
  EXPECT_GT(merged, 15);
  EXPECT_GT(wrong, 30);
}

}  // namespace
}  // namespace adversary
}  // namespace contact_flow
