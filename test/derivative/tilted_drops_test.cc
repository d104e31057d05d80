// SPDX-License-Identifier: BSD-3-Clause
// A quadruped of public proportions falls tilted, and feet land one soon after another: which
// events are one is a matter of how well their instants are known, not of a fixed time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <map>
#include <random>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/random_drop.h"

namespace contact_flow {
namespace {

constexpr int kDrops = 50;

/// Derivatives 0.06 s behind the first touchdown, and one-sided quotients. Where there is none a
/// cascade of plastic bounces was completed, the order decides, or the answer cannot tell it.
TEST(TiltedDrops, HaveDerivativesThatQuotientsConfirm) {
  const auto system = LoadRobot(DropFile("quadruped"));
  const NominalRun& nominal = system->nominal();
  std::map<std::string, int> outcomes;
  for (int seed = 1, drops = 0; drops < kDrops; ++seed) {
    if (seed % 4 == 0) continue;  // level
    ++drops;
    const Vector x = RandomDrop(*system, seed);
    SimulateOptions first;
    first.max_events = 1;
    const Trajectory fall = Simulate(*system, x, nominal.u, 1, first);
    ASSERT_FALSE(fall.transitions.empty());
    const double duration = fall.transitions.front().t + 0.06;
    const Trajectory run = Simulate(*system, x, nominal.u, duration);
    EXPECT_TRUE(run.status.ok()) << seed << ": " << run.status.message;
    const BDerivative B = DifferentiateOutcome(*system, run);
    ++outcomes[OutcomeName(B.status.outcome)];
    if (!B.status.ok()) continue;
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Vector w(2 * system->dof());
    for (double& entry : w) entry = normal(random);
    // Contacts that rest after a landing have risen by up to 1e-5 m/s for 1e-8 s: that is made
    // rest, and the events are held to their law where it is.
    EXPECT_LE(B.trust.event_law, 1e-6) << seed;
    for (const double sign : {1.0, -1.0}) {
      const Vector prediction = B(sign * w);
      const QuotientReport report =
          CompareWithQuotients(*system, x, nominal.u, duration, sign * w, prediction, {1e-6, 1e-7});
      double least = std::numeric_limits<double>::infinity();
      for (const QuotientSample& sample : report.samples) {
        if (sample.status.ok()) least = std::min(least, sample.error);
      }
      // Quotients are off by α times second derivatives of up to some hundreds, and by 1e-12/α.
      EXPECT_LE(least, 1e-4 * (1 + prediction.cwiseAbs().maxCoeff())) << seed << ' ' << sign;
    }
  }
  for (const auto& [outcome, number] : outcomes) std::printf("%d %s\n", number, outcome.c_str());
  EXPECT_GE(outcomes["ok"], 37);
}

}  // namespace
}  // namespace contact_flow
