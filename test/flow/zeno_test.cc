// SPDX-License-Identifier: BSD-3-Clause
// Impacts that accumulate, at every scale of time and restitution.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/flow/zeno_detector.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

/// A ball dropped from 1 m stops bouncing at √(2/g) (1 + γ)/(1 − γ).
TEST(Zeno, HasNoScaleOfItsOwn) {
  for (const double gravity : {1e-8, 1e-3, 9.81, 1e4, 1e8}) {
    for (const double restitution : {1e-12, 1e-6, 1e-3, 0.1, 0.5, 0.9, 0.99}) {
      const auto ball =
          MakeModel("bouncing_ball", {{"gravity", gravity}, {"restitution", restitution}});
      const double exact = std::sqrt(2 / gravity) * (1 + restitution) / (1 - restitution);
      Vector x = Vector::Zero(4);
      x(1) = 1;
      SimulateOptions options;
      const Trajectory stopped = Simulate(*ball, x, Vector(0), 1.2 * exact, options);
      EXPECT_EQ(Outcome::kZeno, stopped.status.outcome) << gravity << ' ' << restitution;
      // Gaps are zero to the floor of the search, 1e-9 m of 1 m, but events are located by Newton's
      // method to rounding; what is predicted is a geometric series whose ratio comes from times.
      EXPECT_NEAR(1, stopped.accumulation_time / exact, 1e-6) << gravity << ' ' << restitution;
      options.complete_zeno = true;
      const Trajectory completed = Simulate(*ball, x, Vector(0), 1.2 * exact, options);
      ASSERT_TRUE(completed.status.ok()) << completed.status.message;
      EXPECT_EQ(ContactMode({0}), completed.arcs.back().mode);
      EXPECT_TRUE(completed.transitions.back().completes_zeno);
      EXPECT_GT(completed.transitions.back().t, exact * (1 - 1e-3 / (1 - restitution)));
      // What is left rises to the absolute tolerance at most, or to 1e-10 of the first bounce.
      EXPECT_LE(completed.transitions.back().energy_lost, 1.01e-9 * gravity);
      ASSERT_EQ(1, completed.num_warnings);
      EXPECT_EQ(Outcome::kZeno, completed.warnings[0].code);
    }
  }
}

/// Plastic corners that hit in turns; the lower the block, the faster: a factor (1 − k)/(1 + k) of
/// the rate each time, 1/25 for a height of 0.3, so that the last rise below the speed tolerance.
TEST(Zeno, ABlockRocksToRestAtEveryHeight) {
  for (const double height : {0.29, 0.3, 0.35, 0.5, 0.7, 1.0}) {
    const auto block = MakeModel("rocking_block", {{"height", height}});
    const Vector x = block->nominal().x;
    SimulateOptions options;
    const Trajectory stopped = Simulate(*block, x, Vector(0), 3, options);
    EXPECT_EQ(Outcome::kZeno, stopped.status.outcome) << height << stopped.status.message;
    options.complete_zeno = true;
    const Trajectory rest = Simulate(*block, x, Vector(0), 3, options);
    ASSERT_TRUE(rest.status.ok()) << rest.status.message;
    int completed = 0;
    for (const Transition& transition : rest.transitions) completed += transition.completes_zeno;
    EXPECT_EQ(1, completed) << height;
    EXPECT_EQ(ContactMode({0, 1}), rest.arcs.back().mode);
    EXPECT_FALSE(DifferentiateOutcome(*block, rest).status.ok());
  }
}

TEST(ZenoDetector, ComparesIntervalsWithTheFirstOfTheirSequence) {
  for (const double scale : {1e-8, 1.0, 1e8}) {
    ZenoDetector detector(2, 1e-3);
    double t = 0, interval = scale;
    int impacts = 1;
    std::optional<double> end = detector.Impact({0}, t);
    while (!end && impacts < 100) {
      t += interval;
      interval *= 0.5;
      end = detector.Impact({impacts++ % 2}, t);
    }
    ASSERT_TRUE(end);
    EXPECT_NEAR(2 * scale, *end, 1e-12 * scale);
    EXPECT_EQ(12, impacts) << "the first interval below 1e-3 of the first is the eleventh";
  }
}

/// Three impacts that recur, each time 0.6 times as far apart: 1, 0.1 and 0.02 at first.
TEST(ZenoDetector, APatternOfSeveralImpactsIsASequence) {
  for (const double scale : {1e-8, 1.0, 1e8}) {
    ZenoDetector detector(4, 1e-3);
    double t = 0, size = scale;
    std::optional<double> end;
    int times = 0;
    for (; !end && times < 50; ++times, size *= 0.6) {
      const ConstraintSet hit = times % 2 == 0 ? ConstraintSet{0, 1} : ConstraintSet{2, 3};
      for (const double part : {1.0, 0.1, 0.02}) {
        t += part * size;
        end = detector.Impact(hit, t);
        if (end) break;
      }
    }
    ASSERT_TRUE(end);
    EXPECT_NEAR(1.12 / 0.4 * scale, *end, 1e-9 * scale);
    EXPECT_EQ(ConstraintSet({0, 1, 2, 3}), detector.pattern());
    EXPECT_GE(times, 13) << "0.6^13 is the first below 1e-3";
    EXPECT_LE(times, 16);
  }
}

TEST(ZenoDetector, IntervalsThatDoNotShrinkAreNoSequence) {
  ZenoDetector detector(1, 1e-3);
  double t = 0;
  for (int k = 0; k < 50; ++k) {
    t += k % 2 == 0 ? 1 : 1e-6;
    EXPECT_FALSE(detector.Impact({0}, t));
  }
}

}  // namespace
}  // namespace contact_flow
