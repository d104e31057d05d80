// SPDX-License-Identifier: BSD-3-Clause
// A ball that is to rest at a height at the end is kicked on its way. Solved again it gets there at
// the least cost that is left, by Bellman's principle and by a search of the rest alone; under the
// first policy it does not. Solves that are late, and that fail.
#include <cstdio>

#include "test/trajectory_optimization/receding_ball.h"

namespace contact_flow {
namespace {

using test::kHorizon;
using test::kIntervals;
using test::kKnown;
using test::kLength;
using test::RecedingBall;

/// Nothing disturbs: by Bellman's principle what was chosen for the rest is chosen again.
TEST_F(RecedingBall, ChoosesTheSameAgain) {
  const Loop fixed = Close(0, false), again = Close(0, true);
  ASSERT_EQ(kIntervals - 1u, again.reports.size());
  double largest = 0;
  for (std::size_t i = 0; i < fixed.inputs.size(); ++i) {
    largest = std::max(largest, std::abs(fixed.inputs[i](0) - again.inputs[i](0)));
  }
  // H of an interval is 2 · 0.01 / 16 s at least, and a promise of 1e-10 counts as none: each
  // solve may leave √(2e-10/1e-3) N.
  EXPECT_LT(largest, kIntervals * 4.5e-4);
  EXPECT_NEAR(fixed.cost, again.cost, 1e-6);
  for (const RecedingTracker::Report& report : again.reports) {
    EXPECT_TRUE(report.followed) << report.solution.begin << report.message;
    EXPECT_EQ(HorizonVerdict::kSolved, report.solution.verdict) << report.solution.message;
    EXPECT_NEAR(report.solution.first_cost, report.solution.cost, 1e-6);
    EXPECT_GT(report.solution.seconds, 0);
  }
}

TEST_F(RecedingBall, ComesToTheGoalThoughItIsKicked) {
  for (double kick : {1.5, -1.5, 3.0}) {
    const Loop fixed = Close(kick, false, kKnown), again = Close(kick, true, kKnown);
    const RecedingTracker::Report* report = nullptr;
    for (const RecedingTracker::Report& other : again.reports) {
      if (other.solution.begin == kKnown) report = &other;
    }
    ASSERT_NE(nullptr, report);
    ASSERT_TRUE(report->followed) << report->message << report->solution.message;
    TrajectoryProblem rest = problem.whole;
    rest.x = report->solution.x;
    rest.duration = kHorizon - kKnown;
    rest.inputs = {};
    for (int k = 6; k < kIntervals; ++k) {
      rest.inputs.grid.push_back((k - 6) * kLength);
      rest.inputs.values.push_back(Vector::Zero(1));
    }
    const TrajectoryOptimum least = OptimizeTrajectory(*ball, rest);
    std::printf(
        "kicked by %+.1f m/s: ends at %.4f m, %+.4f m/s by solving again, at %.4f m, %+.4f "
        "m/s by the first policy; cost %.4f and %.4f, by a search of the rest %.4f\n",
        kick, again.x(0), again.x(1), fixed.x(0), fixed.x(1), again.cost, fixed.cost, least.cost);
    EXPECT_LT((again.x - problem.whole.target).norm(),
              0.35 * (fixed.x - problem.whole.target).norm())
        << kick;
    EXPECT_LT(again.cost, 0.3 * fixed.cost) << kick;
    EXPECT_NEAR(report->solution.cost, again.cost, 1e-4 * (1 + again.cost)) << kick;
    EXPECT_LE(again.cost, least.cost + 1e-4) << kick;
  }
}

/// The window of a solve is the part of the whole that is named: its cost is that of this part.
TEST_F(RecedingBall, WindowsAreParts) {
  problem.intervals = 4;
  problem.goals = Matrix::Zero(2, kIntervals);
  problem.goals(0, 7) = 0.7;  // at 0.5 s
  problem.whole.input_path = Matrix::Constant(1, kIntervals, 3);
  problem.whole.input_path.middleCols(4, 4).setConstant(-1);
  options.max_iterations = 0;
  const RecedingTracker tracker(first);
  const Trajectory run = Simulate(*ball, problem.whole.x, problem.whole.inputs, kHorizon, Exact());
  constexpr double kT = 0.25 - 1.0 / 32, kBegin = 0.25 + 1.0 / 64;
  const Vector x = run.State(kT);
  const HorizonSolution found = SolveHorizon(ball, problem, options, tracker.Task(kT, x, kBegin));
  ASSERT_NE(nullptr, found.policy) << found.message;
  const InputSchedule& inputs = found.policy->reference.inputs();
  ASSERT_EQ(4u, inputs.grid.size());
  EXPECT_EQ(kBegin, inputs.grid[0]);
  EXPECT_EQ(5 * kLength, inputs.grid[1]);
  EXPECT_EQ(0.5, found.policy->reference.phases().back().t_end);
  double cost = 100 * (run.State(0.5) - Eigen::Vector2d(0.7, 0)).squaredNorm();
  for (std::size_t k = 4; k < 8; ++k) {
    const double u = problem.whole.inputs.values[k](0);
    cost += (k == 4 ? 3.0 / 64 : kLength) * 0.01 * (u + 1) * (u + 1);
  }
  // Of the shifted inputs, though the feedback may bring it nearer by rounding.
  EXPECT_NEAR(cost, found.first_cost, 1e-8 * cost);
  // Less than a quarter of an interval goes with the next one.
  const HorizonSolution late =
      SolveHorizon(ball, problem, options, tracker.Task(kT, x, 5 * kLength - 1.0 / 128));
  ASSERT_NE(nullptr, late.policy) << late.message;
  EXPECT_EQ(6 * kLength, late.policy->reference.inputs().grid[1]);
  // Nothing is left of the whole.
  EXPECT_EQ(nullptr,
            SolveHorizon(ball, problem, options, tracker.Task(1.4, x, kHorizon - 0.001)).policy);
}

/// What is late changes nothing: the inputs are those of the last policy, to the bit.
TEST_F(RecedingBall, ALateSolveKeepsTheLastPolicy) {
  const Loop fixed = Close(1, false);
  options.budget = 1e-7;
  const Loop late = Close(1, true);
  ASSERT_EQ(kIntervals - 1u, late.reports.size());
  for (const RecedingTracker::Report& report : late.reports) {
    EXPECT_EQ(HorizonVerdict::kLate, report.solution.verdict) << report.solution.message;
    EXPECT_FALSE(report.followed);
    EXPECT_NE(std::string::npos, report.message.find("the last policy is kept")) << report.message;
  }
  EXPECT_EQ(fixed.inputs, late.inputs);
}

TEST_F(RecedingBall, AnUnfinishedSearchIsFollowed) {
  options.max_iterations = 1;
  RecedingTracker tracker(first);
  const HorizonSolution found =
      SolveHorizon(ball, problem, options, TaskAt(tracker, 0.3, 0.6, -1.9));
  EXPECT_EQ(HorizonVerdict::kUnfinished, found.verdict) << found.message;
  EXPECT_NE(nullptr, found.policy);
  EXPECT_LT(found.cost, found.first_cost);
}

TEST_F(RecedingBall, AFailedSolveKeepsTheLastPolicy) {
  RecedingTracker tracker(first);
  const HorizonSolution below = SolveHorizon(ball, problem, options, TaskAt(tracker, 0.3, -0.1, 0));
  EXPECT_EQ(HorizonVerdict::kFailed, below.verdict);
  EXPECT_NE(std::string::npos, below.message.find("floor")) << below.message;
  tracker.Offer(below);
  ASSERT_EQ(1u, tracker.reports().size());
  EXPECT_FALSE(tracker.reports()[0].followed);
  EXPECT_EQ(first.get(), &tracker.policy());
  // A ball that lies ends in no time, and its bounces are Zeno.
  const HorizonSolution lies =
      SolveHorizon(ball, problem, options, tracker.Task(0.3, Eigen::Vector2d(1e-3, 0), 1.0));
  EXPECT_EQ(HorizonVerdict::kFailed, lies.verdict) << lies.message;
  EXPECT_EQ(nullptr, lies.policy);
}

/// Optima like touchdowns at instants of the grid, at which solutions begin: behind the impact.
TEST_F(RecedingBall, BeginsAtATouchdown) {
  const double hit = std::sqrt(2 / 9.8), v = 9.8 * hit;
  problem.whole.inputs.values.assign(kIntervals, Vector::Zero(1));
  const auto falls = std::make_shared<const TrackingPolicy>(FirstPolicy(*ball, problem, options));
  const RecedingTracker tracker(falls);
  for (double off : {-1e-10, -1e-12, 0.0, 1e-12, 1e-10}) {
    const HorizonSolution found =
        SolveHorizon(ball, problem, options, tracker.Task(0, Eigen::Vector2d(1, 0), hit + off));
    EXPECT_EQ(HorizonVerdict::kSolved, found.verdict) << off << found.message;
    EXPECT_EQ(std::vector<int>{1}, found.changes) << off;
    ASSERT_EQ(2, found.x.size());
    EXPECT_NEAR(0.7 * v, found.x(1), 1e-6) << off;
  }
}

TEST_F(RecedingBall, FollowsAReference) {
  HorizonProblem follow = FollowReference(*first, Vector::Constant(1, 1), Vector::Constant(1, 10),
                                          Eigen::Vector2d(10, 1), 10);
  EXPECT_NEAR(first->reference.State(first->reference.PhaseAt(0.5), 0.5)(0), follow.goals(0, 7),
              1e-12);
  const RecedingTracker tracker(first);
  const Trajectory run = Simulate(*ball, problem.whole.x, problem.whole.inputs, kHorizon, Exact());
  const HorizonSolution same =
      SolveHorizon(ball, follow, options, tracker.Task(0.125, run.State(0.125), 0.1875));
  EXPECT_EQ(HorizonVerdict::kSolved, same.verdict) << same.message;
  EXPECT_LT(same.first_cost, 1e-9);  // it is there
  const HorizonSolution higher =
      SolveHorizon(ball, follow, options,
                   tracker.Task(0.125, run.State(0.125) + Eigen::Vector2d(0.2, 0), 0.1875));
  EXPECT_EQ(HorizonVerdict::kSolved, higher.verdict) << higher.message;
  EXPECT_LT(higher.cost, higher.first_cost);
}

TEST_F(RecedingBall, MisuseIsRefused) {
  const RecedingTracker tracker(first);
  const HorizonTask task = TaskAt(tracker, 0.3, 0.6, -1.9);
  const auto refuses = [&](const HorizonProblem& wrong, const HorizonOptions& settings) {
    EXPECT_THROW(SolveHorizon(ball, wrong, settings, task), std::invalid_argument);
  };
  HorizonProblem wrong = problem;
  wrong.whole.choose_durations = {1};
  refuses(wrong, options);
  wrong = problem;
  wrong.whole.conditions.push_back({TrajectoryCondition::Kind::kTouchdown, 0, 0, 0.5, 0.5});
  refuses(wrong, options);
  wrong = problem;
  wrong.goals = Matrix::Zero(2, 3);
  refuses(wrong, options);
  wrong = problem;
  wrong.whole.input_path = Matrix::Zero(1, 3);
  refuses(wrong, options);
  HorizonOptions settings = options;
  settings.budget = 0;
  refuses(problem, settings);
  HorizonTask back = task;
  back.begin = 0.2;
  EXPECT_THROW(SolveHorizon(ball, problem, options, back), std::invalid_argument);
}

}  // namespace
}  // namespace contact_flow
