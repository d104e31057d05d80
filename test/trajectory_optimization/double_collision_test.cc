// SPDX-License-Identifier: BSD-3-Clause
// One disc hits another, which bounces off the wall and is stopped by a second collision: costs of
// a goal that costs, and of one that is to hold, against those of linear systems of equations.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "test/trajectory_optimization/line_problem_runs.h"

namespace contact_flow {
namespace {

using test::LineProblem;
using Instants = std::array<double, 3>;

constexpr double kWall = 1, kSecond = -0.1;  // of the second disc, at rest
const std::vector<LineProblem::Event> kEvents = {{Eigen::Vector2d(-1, 1), -0.4, 1},
                                                 {Eigen::Vector2d(0, -1), kWall - 0.2, 1},
                                                 {Eigen::Vector2d(-1, 1), -0.4, 1}};

/// Both discs are at rest and are to be so again where they were.
LineProblem Twice(int count, bool linear, bool holds) {
  LineProblem line;
  line.mass = Eigen::Vector2d(1, 1);
  line.x = Eigen::Vector4d(-0.8, kSecond, 0, 0);
  line.duration = 2;
  line.count = count;
  line.linear = linear;
  line.effort = 0.01;
  line.target = line.x;
  line.weight = Eigen::Vector4d(1, 10, 1, 1);
  if (!holds) return line;
  line.weight.setZero();
  line.held = {0, 1, 2, 3};
  return line;
}

/// What is stopped at its goal is there when it is met: as far from the wall as at the begin.
double LeastCostAt(const LineProblem& line, Instants t) {
  if (!line.held.empty()) t[2] = 2 * t[1] - t[0];
  return line.Cost(kEvents, {t[0], t[1], t[2]});
}

/// The problem of the discs; the search begins with the least effort for these instants.
TrajectoryProblem ProblemOf(const LineProblem& line, const Instants& t) {
  LineProblem soft = line;
  if (!line.held.empty()) soft = Twice(line.count, line.linear, false);
  Vector u;
  soft.Cost(kEvents, {t[0], t[1], t[2]}, &u);
  TrajectoryProblem problem = test::DiscsOf(line, 0);
  for (int k = 0; k < line.count; ++k) {
    problem.inputs.values[static_cast<std::size_t>(k)](1) = u(k);
  }
  if (line.linear) problem.input_end = Eigen::Vector2d(0, u(line.count));
  for (int i : line.held) {
    TrajectoryCondition condition;
    condition.index = 2 * i + 1;
    condition.number = line.count;
    condition.lower = condition.upper = line.target(i);
    problem.conditions.push_back(condition);
  }
  return problem;
}

std::vector<double> InstantsMet(const MechanicalSystem& system, const TrajectoryProblem& problem,
                                const TrajectoryOptimum& found) {
  const Unknowns unknowns(system, problem);
  std::vector<double> instants;
  for (const Transition& event : unknowns.Run(found.y, 1e-12, false).transitions) {
    if (!event.activated.Empty()) instants.push_back(event.t);
  }
  return instants;
}

/// The cost is that of the closed form with collisions at these instants, and with none near them
/// it is less.
TEST(DoubleCollision, CostsAreThoseOfTheClosedForm) {
  const auto discs = MakeModel("two_discs", {{"wall", kWall}});
  double worst = 0;
  for (const int count : {6, 14}) {
    for (const bool linear : {false, true}) {
      for (const bool holds : {false, true}) {
        const LineProblem line = Twice(count, linear, holds);
        const TrajectoryProblem problem = ProblemOf(line, {0.55, 1.1, 1.45});
        const TrajectoryOptimum found = OptimizeTrajectory(*discs, problem);
        const std::string which = std::to_string(count) + (linear ? " led" : " held") +
                                  (holds ? ", with conditions" : "");
        ASSERT_TRUE(found.verdict == TrajectoryVerdict::kSmoothMinimum ||
                    found.verdict == TrajectoryVerdict::kValley)
            << which << ": " << found.message;
        const std::vector<double> met = InstantsMet(*discs, problem, found);
        ASSERT_EQ(3u, met.size()) << which;
        const Instants at = {met[0], met[1], met[2]};
        // Conditions are met to 1e-8, and a unit of theirs costs about 0.3.
        const double allowed = holds ? 1e-6 * found.cost : 1e-8 * found.cost;
        EXPECT_NEAR(LeastCostAt(line, at), found.cost, allowed) << which;
        double least = found.cost;
        std::mt19937 random(1);
        std::normal_distribution<double> normal;
        for (int trial = 0; trial < 100; ++trial) {
          for (double step : {1e-4, 1e-3, 1e-2}) {
            Instants t = at;
            for (double& instant : t) instant += step * normal(random);
            least = std::min(least, LeastCostAt(line, t));
          }
        }
        EXPECT_GT(least, found.cost - allowed) << which;
        worst = std::max(worst, std::abs(LeastCostAt(line, at) / found.cost - 1));
      }
    }
  }
  std::printf("costs of two collisions within %.1e\n", worst);
}

/// What is least does not depend on the unit of the cost.
TEST(DoubleCollision, CostsInSmallUnits) {
  const auto discs = MakeModel("two_discs", {{"wall", kWall}});
  TrajectoryProblem problem = ProblemOf(Twice(6, true, false), {0.55, 1.1, 1.45});
  const double cost = OptimizeTrajectory(*discs, problem).cost;
  for (double unit : {1e-4, 1e-6, 1e-8}) {
    TrajectoryProblem small = problem;
    small.effort *= unit;
    small.weight *= unit;
    const TrajectoryOptimum found = OptimizeTrajectory(*discs, small);
    EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
    EXPECT_NEAR(unit * cost, found.cost, 1e-7 * unit * cost) << unit;
  }
}

/// A minimum that was found stays one where iterations end while its neighbours are tried.
TEST(DoubleCollision, IterationsThatEndAmongNeighboursLeaveTheValley) {
  const auto discs = MakeModel("two_discs", {{"wall", kWall}});
  const TrajectoryProblem problem = ProblemOf(Twice(6, false, false), {0.55, 1.1, 1.45});
  TrajectoryOptions options;
  const TrajectoryOptimum alone = OptimizeTrajectory(*discs, problem, options);
  ASSERT_EQ(TrajectoryVerdict::kValley, alone.verdict) << alone.message;
  options.neighbours = true;
  for (int more : {0, 1, 2}) {
    options.max_iterations = static_cast<int>(alone.iterations.size()) + more;
    const TrajectoryOptimum found = OptimizeTrajectory(*discs, problem, options);
    EXPECT_EQ(TrajectoryVerdict::kValley, found.verdict) << found.message;
    EXPECT_EQ(alone.cost, found.cost);
    EXPECT_EQ(alone.certificate.size(), found.certificate.size());
    EXPECT_NE(std::string::npos, found.message.find("not all neighbours were tried"))
        << found.message;
  }
}

}  // namespace
}  // namespace contact_flow
