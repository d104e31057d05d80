// SPDX-License-Identifier: BSD-3-Clause
// Random trajectory problems, nonlinear and with several touchdowns: what is called a minimum is
// one along random directions, by plain runs.
#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <random>

#include "contact_flow/model/model_library.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "test/derivative/input_cases.h"

namespace contact_flow {
namespace {

class RandomProblem {
 public:
  explicit RandomProblem(int seed) : random_(static_cast<unsigned>(seed)) {
    const int intervals = 10 + seed;
    if (seed % 3 == 0) {
      system = MakeModel("double_pendulum");
      problem.x = system->nominal().x;
      problem.duration = 1.2;
    } else {
      test::PushedBodies::Parameters<double> p;
      p.first = seed % 2 == 1 ? 0 : 0.6;
      p.second = seed % 4 < 2 ? 0 : 0.5;
      p.bend = Uniform(-0.3, 0.3);
      p.coupling = Uniform(-1, 1);
      system = std::make_unique<test::Bodies>(test::Named(p));
      problem.x = Vector::Zero(6);
      problem.x.head(3) << Uniform(0.4, 1), Uniform(0.4, 1), 1.5;
      problem.duration = 0.7;
    }
    for (int k = 0; k < intervals; ++k) {
      problem.inputs.grid.push_back(problem.duration * k / intervals);
      problem.inputs.values.push_back(Vector::Zero(2));
    }
    problem.effort = Vector::Constant(2, 0.02);
    const Eigen::Index size = system->state_size();
    problem.weight = Vector::NullaryExpr(size, [&] { return Uniform(0, 10); });
    problem.target = Vector::NullaryExpr(size, [&] { return Uniform(0, 1); });
  }

  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  std::unique_ptr<MechanicalSystem> system;
  TrajectoryProblem problem;

 private:
  std::mt19937 random_;
};

/// A slope of a plain run that falls by less than this is none: the model's promise is below 1e-10
/// (1 + J), so that g is below √(2e-10 H), with H of order 1 … 10 per interval.
constexpr double kNoSlope = 1e-4;

TEST(RandomTrajectories, MinimaHaveNoDirectionOfDescent) {
  int minima = 0, valleys = 0, stalled = 0;
  for (int seed = 0; seed < 9; ++seed) {
    RandomProblem random(seed);
    const TrajectoryOptimum found = OptimizeTrajectory(*random.system, random.problem);
    if (found.verdict == TrajectoryVerdict::kStalled) {
      EXPECT_NE(std::string::npos, found.message.find(':')) << "no reason: " << found.message;
      ++stalled;
      continue;
    }
    ASSERT_TRUE(found.verdict == TrajectoryVerdict::kValley ||
                found.verdict == TrajectoryVerdict::kSmoothMinimum)
        << seed << ": " << found.message;
    ++minima;
    valleys += found.verdict == TrajectoryVerdict::kValley;
    EXPECT_LT(found.hull_distance, 1e-3) << seed;
    const Unknowns unknowns(*random.system, random.problem);
    for (int j = 0; j < 60; ++j) {
      const Vector d = Vector::NullaryExpr(found.y.size(), [&] { return random.Uniform(-1, 1); });
      constexpr double kAlpha = 1e-4;
      const Vector y = found.y + kAlpha * d;
      const Trajectory run = unknowns.Run(y, 1e-12, false);
      ASSERT_TRUE(run.status.ok()) << seed << run.status.message;
      const double cost = unknowns.Cost(y, unknowns.States(run));
      EXPECT_GT((cost - found.cost) / kAlpha, -kNoSlope) << seed << ", direction " << j;
    }
  }
  std::printf("%d minima, %d of them valleys, %d stalled with the reason\n", minima, valleys,
              stalled);
  EXPECT_GE(minima, 7);
  EXPECT_GE(valleys, 3);
}

}  // namespace
}  // namespace contact_flow
