// SPDX-License-Identifier: BSD-3-Clause
// Solutions that come too late, for another motion, before an event that is late; windows that end.
#include "contact_flow/trajectory_optimization/receding_tracker.h"

#include "test/trajectory_optimization/receding_ball.h"

namespace contact_flow {
namespace {

using test::kHorizon;
using test::kIntervals;
using test::kLength;
using test::RecedingBall;

/// A solution that comes after its begin, or for a motion that was another one, is not followed.
TEST_F(RecedingBall, WhatComesTooLateOrForAnotherMotionIsNotFollowed) {
  const double hit = first->reference.phases()[0].t_end;
  RecedingTracker tracker(first);
  const HorizonSolution found =
      SolveHorizon(ball, problem, options, TaskAt(tracker, 0.3, 0.6, -1.9));
  ASSERT_NE(nullptr, found.policy) << found.message;
  tracker.Input(0.4, Eigen::Vector2d(0.4, -2));
  tracker.Offer(found);
  ASSERT_EQ(1u, tracker.reports().size());
  EXPECT_EQ("it has come after its begin", tracker.reports()[0].message);
  RecedingTracker other(first);
  other.Offer(found);
  other.Observe(0.32, {0}, {}, ConstraintSet());  // nobody has expected that
  other.Input(0.36, Eigen::Vector2d(0.4, 2));
  ASSERT_EQ(1u, other.reports().size());
  EXPECT_FALSE(other.reports()[0].followed);
  EXPECT_EQ(first.get(), &other.policy());
  RecedingTracker in_time(first);
  in_time.Offer(found);
  in_time.Input(0.349, Eigen::Vector2d(0.5, -2));
  EXPECT_EQ(first.get(), &in_time.policy());
  in_time.Input(0.35, Eigen::Vector2d(0.5, -2));
  EXPECT_EQ(found.policy.get(), &in_time.policy());
  ASSERT_EQ(1u, in_time.reports().size());
  EXPECT_TRUE(in_time.reports()[0].followed);
  EXPECT_GT(hit, 0.36);
}

/// What is expected by the begin of a solution may come a little later: it is followed from then.
TEST_F(RecedingBall, AnEventThatComesLateIsWaitedFor) {
  const double hit = first->reference.phases()[0].t_end;
  RecedingTracker tracker(first), plain(first);
  const Trajectory run = Simulate(*ball, problem.whole.x, problem.whole.inputs, kHorizon);
  const HorizonSolution found = SolveHorizon(
      ball, problem, options, tracker.Task(hit - 0.02, run.State(hit - 0.02), hit + 0.01));
  ASSERT_NE(nullptr, found.policy) << found.message;
  EXPECT_EQ(std::vector<int>{1}, found.changes);
  for (const bool ever : {true, false}) {
    RecedingTracker each(first);
    each.Offer(found);
    each.Input(hit + 0.015, Eigen::Vector2d(0.01, -3));
    EXPECT_TRUE(each.Waits());
    EXPECT_EQ(first.get(), &each.policy());
    if (ever) each.Observe(hit + 0.016, {0}, {}, ConstraintSet());
    each.Input(hit + (ever ? 0.017 : 0.12), Eigen::Vector2d(0.01, 3));
    EXPECT_FALSE(each.Waits());
    EXPECT_EQ(ever ? found.policy.get() : first.get(), &each.policy());
    ASSERT_EQ(1u, each.reports().size());
    EXPECT_EQ(ever, each.reports()[0].followed);
  }
}

/// Beyond the end of a short window the first policy goes on, which has seen the touchdown.
TEST_F(RecedingBall, BeyondAWindowTheFirstPolicyGoesOn) {
  problem.intervals = 2;
  problem.goals = Matrix::Zero(2, kIntervals);
  RecedingTracker tracker(first), plain(first);
  const double hit = first->reference.phases()[0].t_end;
  const Trajectory run = Simulate(*ball, problem.whole.x, problem.whole.inputs, kHorizon);
  const double t = std::floor(hit / kLength) * kLength - kLength;
  HorizonSolution found =
      SolveHorizon(ball, problem, options, tracker.Task(t, run.State(t), t + kLength));
  ASSERT_NE(nullptr, found.policy) << found.message;
  tracker.Offer(found);
  const double end = found.policy->reference.phases().back().t_end;
  ASSERT_GT(end, hit);
  for (RecedingTracker* each : {&tracker, &plain}) {
    each->Input(t + kLength, run.State(t + kLength));
    each->Observe(hit, {0}, {}, ConstraintSet());
    each->Input(end - 0.01, run.State(end - 0.01));
  }
  EXPECT_EQ(found.policy.get(), &tracker.policy());
  EXPECT_EQ(plain.Input(end + 0.01, Eigen::Vector2d(0.3, 1)),
            tracker.Input(end + 0.01, Eigen::Vector2d(0.3, 1)));
  EXPECT_EQ(first.get(), &tracker.policy());
  EXPECT_EQ(1, tracker.phase());
}

}  // namespace
}  // namespace contact_flow
