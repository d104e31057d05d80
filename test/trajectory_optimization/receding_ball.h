// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <string>

#include "contact_flow/flow/online_flow.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "contact_flow/trajectory_optimization/receding_tracker.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace test {

inline constexpr int kIntervals = 24;
inline constexpr int kSteps = 64;  // of the loop in an interval
// Powers of two, so that instants of the grid are met by the loop.
inline constexpr double kLength = 1.0 / 16, kHorizon = kIntervals * kLength;
inline constexpr double kPeriod = kLength / kSteps;
inline constexpr int kKick = 5 * kSteps;       // when it is kicked, …
inline constexpr double kKnown = 6 * kLength;  // … and the begin of the solution that knows
inline constexpr double kForce = 3;            // [N] at most

/// A ball falls from 1 m and is to be at rest at 0.5 m after 1.5 s. The feedback is the best linear
/// one for the same cost.
class RecedingBall : public testing::Test {
 protected:
  RecedingBall() : ball(MakeModel("driven_ball")) {
    TrajectoryProblem& whole = problem.whole;
    whole.x = Eigen::Vector2d(1, 0);
    for (int k = 0; k < kIntervals; ++k) {
      whole.inputs.grid.push_back(k * kLength);
      whole.inputs.values.push_back(Vector::Zero(1));
    }
    whole.duration = kHorizon;
    whole.effort = Vector::Constant(1, 0.01);
    whole.weight = Eigen::Vector2d(100, 100);
    whole.target = Eigen::Vector2d(0.5, 0);
    whole.lower = Vector::Constant(1, -kForce);
    whole.upper = Vector::Constant(1, kForce);
    options.weights = {Vector::Zero(2), whole.effort, whole.weight};
    options.period = kPeriod;
    options.budget = kInfinity;
    options.max_iterations = 200;
    options.tolerance = 1e-10;
    whole.inputs = OptimizeTrajectory(*ball, whole).inputs;
    first = std::make_shared<const TrackingPolicy>(FirstPolicy(*ball, problem, options));
  }

  struct Loop {
    Vector x;         ///< at the end
    double cost = 0;  ///< J from `from` on, of the inputs as they were
    std::vector<RecedingTracker::Report> reports;
    std::vector<Vector> inputs;
  };
  /// The loop; the ball gets `kick` [m/s] on its way. Solved in the middle of every interval
  /// of the grid for its end, unless `solve` is false.
  Loop Close(double kick, bool solve, double from = 0) const {
    RecedingTracker tracker(first);
    auto flow = std::make_unique<OnlineFlow>(ball, 0, problem.whole.x, Vector::Zero(1), Exact());
    Loop loop;
    constexpr int kAll = kIntervals * kSteps, kHalf = kSteps / 2;
    for (int i = 0; i < kAll; ++i) {
      const double t = kPeriod * i;
      Advance(flow.get(), t, &tracker);
      if (i == kKick && kick != 0) {
        Vector x = flow->State();
        x(1) += kick;
        flow = std::make_unique<OnlineFlow>(ball, t, x, flow->u(), Exact());
      }
      if (solve && i % kSteps == kHalf && i + kHalf < kAll) {
        const double begin = kPeriod * (i + kHalf);
        tracker.Offer(SolveHorizon(ball, problem, options, tracker.Task(t, flow->State(), begin)));
      }
      loop.inputs.push_back(tracker.Input(t, flow->State()));
      if (t >= from) loop.cost += kPeriod * 0.01 * loop.inputs.back().squaredNorm();
      flow->SetInput(t, loop.inputs.back());
    }
    Advance(flow.get(), kHorizon, &tracker);
    loop.x = flow->State();
    loop.cost += 100 * (loop.x - problem.whole.target).squaredNorm();
    loop.reports = tracker.reports();
    return loop;
  }

  static SimulateOptions Exact() {
    SimulateOptions exact;
    exact.relative_tolerance = exact.absolute_tolerance = 1e-12;
    return exact;
  }

  static void Advance(OnlineFlow* flow, double t, RecedingTracker* tracker) {
    while (flow->AdvanceTo(t)) {
      const Transition& event = flow->transition();
      if ((event.activated | event.released).Empty()) continue;
      tracker->Observe(event.t, event.activated, event.released, event.mode_after);
    }
  }

  HorizonTask TaskAt(const RecedingTracker& tracker, double t, double z, double v) const {
    return tracker.Task(t, Eigen::Vector2d(z, v), t + 0.05);
  }

  const std::shared_ptr<const MechanicalSystem> ball;
  HorizonProblem problem;
  HorizonOptions options;
  std::shared_ptr<const TrackingPolicy> first;
};

}  // namespace test
}  // namespace contact_flow
