// SPDX-License-Identifier: BSD-3-Clause
#include "src/derivative/motion_pace.h"

#include <gtest/gtest.h>

#include <vector>

namespace contact_flow {
namespace {

/// An arc of steps of these lengths [s], from t = 1 s on, along which nothing moves.
DenseArc Steps(const std::vector<double>& lengths) {
  const std::vector<double> still(kDenseOrder, 0.0);
  DenseArc arc;
  double t = 1;
  for (double length : lengths) {
    arc.Append(t, length, still.data(), 1);
    t += length;
  }
  return arc;
}

/// A sixth of the arc a sample, and two more: what the length of the arc alone allows.
double Longest(double span, int samples) { return (samples + 2) * span / 6; }

TEST(MotionPace, TakesAsManyStepsAsTheStateDid) {
  const MotionPace pace(Steps({0.1, 0.02, 0.02, 0.02, 0.1}));
  EXPECT_NEAR(0.1, pace.Reach(1.0, 2), 1e-12);  // up to the first that is short
  EXPECT_NEAR(0.04, pace.Reach(1.11, 2), 1e-12);
}

/// A reference that changes cuts a step short, and the next one is as long as those before: the
/// motion is no quicker there. The last step, which the arc's end cuts, is held by none either.
TEST(MotionPace, IsNotHeldByAStepThatSomethingElseCutShort) {
  for (const std::vector<double>& lengths :
       {std::vector<double>{0.1, 1e-9, 0.05}, std::vector<double>{0.1, 1e-9, 0.1, 0.05}}) {
    const DenseArc arc = Steps(lengths);
    const double span = arc.StepBegin(lengths.size() - 1) + lengths.back() - 1;
    const MotionPace pace(arc);
    EXPECT_NEAR(Longest(span, 4), pace.Reach(1.0, 4), 1e-9);
    EXPECT_NEAR(Longest(span, 4), pace.Reach(1.101, 4), 1e-9);
  }
}

}  // namespace
}  // namespace contact_flow
