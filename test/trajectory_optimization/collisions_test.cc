// SPDX-License-Identifier: BSD-3-Clause
// Bodies on a line that collide, of unequal masses, elastic and not, once and twice, under inputs
// that are held or led on coarse grids: costs against those of linear systems of equations.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <vector>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "test/trajectory_optimization/line_problem_runs.h"

namespace contact_flow {
namespace {

using test::LineProblem;

bool IsMinimum(const TrajectoryOptimum& found) {
  return found.verdict == TrajectoryVerdict::kSmoothMinimum ||
         found.verdict == TrajectoryVerdict::kValley;
}

/// The touchdowns of a run: contacts and instants.
struct Touchdowns {
  std::vector<int> contacts;
  std::vector<double> instants;
};

Touchdowns TouchdownsOf(const MechanicalSystem& system, const TrajectoryProblem& problem,
                        const TrajectoryOptimum& found) {
  const Unknowns unknowns(system, problem);
  Touchdowns met;
  for (const Transition& event : unknowns.Run(found.y, 1e-12, false).transitions) {
    for (int i : event.activated) {
      met.contacts.push_back(i);
      met.instants.push_back(event.t);
    }
  }
  return met;
}

/// J of a run of the problem under the inputs of a line.
double CostOf(const MechanicalSystem& system, const TrajectoryProblem& problem, const Vector& u) {
  const Unknowns unknowns(system, problem);
  Vector y = Vector::Zero(unknowns.size());
  const int m = unknowns.num_inputs();
  for (Eigen::Index k = 0; k < u.size(); ++k) y(k * m + m - 1) = u(k);
  const Trajectory run = unknowns.Run(y, 1e-12, false);
  return run.status.ok() ? unknowns.Cost(y, run) : std::numeric_limits<double>::infinity();
}

/// The found cost is that of the closed form with the same events at the same instants, and no
/// other instants near them cost less, unless their run is another one.
void CheckLocally(const MechanicalSystem& system, const TrajectoryProblem& problem,
                  const LineProblem& line, const std::vector<LineProblem::Event>& events,
                  const Touchdowns& met, double cost, const std::string& which) {
  ASSERT_EQ(events.size(), met.instants.size()) << which;
  EXPECT_NEAR(line.Cost(events, met.instants), cost, 1e-9 * (1 + cost)) << which;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 50; ++trial) {
    for (double step : {1e-4, 1e-3, 1e-2}) {
      std::vector<double> instants = met.instants;
      for (double& t : instants) t += step * normal(random);
      bool in_order = instants.front() > 0 && instants.back() < line.duration;
      for (std::size_t i = 1; i < instants.size(); ++i) {
        in_order = in_order && instants[i - 1] < instants[i];
      }
      if (!in_order) continue;
      Vector u;
      if (line.Cost(events, instants, &u) > cost - 1e-9 * (1 + cost)) continue;
      EXPECT_GT(CostOf(system, problem, u), cost - 1e-9 * (1 + cost)) << which;
    }
  }
}

LineProblem Push(double first, double second, int count, bool linear) {
  LineProblem line;
  line.mass = Eigen::Vector2d(first, second);
  line.x = Eigen::Vector4d(-2, -1, 0, 0);
  line.count = count;
  line.linear = linear;
  line.effort = 0.01;
  line.weight = Eigen::Vector4d(0, 1, 0, 0);
  line.target = Vector::Zero(4);
  return line;
}

const Eigen::Vector2d kBetween(-1, 1);  // the gap q₂ − q₁ − 0.4

/// One disc pushes the other to the origin.
TEST(Collisions, OneOfUnequalMasses) {
  double worst = 0;
  int compared = 0;
  for (const auto& [first, second, e] :
       {std::array<double, 3>{1, 1, 1}, {2, 1, 1}, {1, 3, 1}, {1, 1, 0.5}, {0.5, 2, 0.8}}) {
    const auto discs = MakeModel(
        "two_discs", {{"first_mass", first}, {"second_mass", second}, {"restitution", e}});
    for (const int count : {1, 2, 4, 8, 24}) {
      for (const bool linear : {false, true}) {
        const LineProblem line = Push(first, second, count, linear);
        const double best = line.Best({kBetween, -0.4, e}, 0.02, 0.999);
        TrajectoryOptions options;
        options.neighbours = true;
        const TrajectoryProblem problem = test::DiscsOf(line, 3 * first);
        const TrajectoryOptimum found = OptimizeTrajectory(*discs, problem, options);
        const std::string which = std::to_string(first) + ", " + std::to_string(second) + ", e " +
                                  std::to_string(e) + ", " + std::to_string(count) +
                                  (linear ? " led" : " held");
        EXPECT_TRUE(IsMinimum(found)) << which << ": " << found.message;
        if (TouchdownsOf(*discs, problem, found).instants.size() > 1) {  // met again, for less
          EXPECT_LT(found.cost, best) << which;
          continue;
        }
        EXPECT_NEAR(best, found.cost, 1e-8 * best) << which << ": " << found.message;
        worst = std::max(worst, std::abs(found.cost / best - 1));
        ++compared;
      }
    }
  }
  std::printf("%d problems, costs within %.1e\n", compared, worst);
  EXPECT_GE(compared, 45);
}

/// … by way of the wall: the second disc is to be at rest below, behind a collision and a bounce.
TEST(Collisions, OneAndTheWall) {
  for (const auto& [first, second, e] :
       {std::array<double, 3>{1, 1, 1}, {2, 1, 0.9}, {1, 2, 0.8}}) {
    const double wall = 0.5, bounce = 0.9;
    const auto discs = MakeModel("two_discs", {{"first_mass", first},
                                               {"second_mass", second},
                                               {"restitution", e},
                                               {"wall", wall},
                                               {"wall_restitution", bounce}});
    const std::vector<LineProblem::Event> events = {{kBetween, -0.4, e},
                                                    {Eigen::Vector2d(0, -1), wall - 0.2, bounce}};
    for (const int count : {4, 12}) {
      for (const bool linear : {false, true}) {
        LineProblem line = Push(first, second, count, linear);
        line.target(1) = 0;
        TrajectoryOptions options;
        options.neighbours = true;
        TrajectoryProblem problem = test::DiscsOf(line, 12 * first);
        // Later on the first disc gives way.
        for (std::size_t k = 0; k < problem.inputs.grid.size(); ++k) {
          if (problem.inputs.grid[k] > 0.45) problem.inputs.values[k](1) = -15 * first;
        }
        const TrajectoryOptimum found = OptimizeTrajectory(*discs, problem, options);
        const Touchdowns met = TouchdownsOf(*discs, problem, found);
        const std::string which = std::to_string(first) + ", " + std::to_string(second) + ", " +
                                  std::to_string(count) + (linear ? " led" : " held");
        EXPECT_TRUE(IsMinimum(found)) << which << ": " << found.message;
        std::vector<LineProblem::Event> its;
        for (int contact : met.contacts) {
          ASSERT_NE(1, contact) << which;
          its.push_back(events[contact == 0 ? 0 : 1]);
        }
        std::printf("%s: %zu touchdowns, %.9f\n", which.c_str(), its.size(), found.cost);
        if (!its.empty()) CheckLocally(*discs, problem, line, its, met, found.cost, which);
      }
    }
  }
}

/// The driven disc is heavy and pushes the other twice: against the wall, and as it comes back.
TEST(Collisions, TwoOfThem) {
  int twice = 0;
  for (const auto& [first, second, e] : {std::array<double, 3>{1, 1, 1}, {3, 1, 1}, {2, 1, 0.8}}) {
    const double wall = 0;
    const auto discs = MakeModel(
        "two_discs",
        {{"first_mass", first}, {"second_mass", second}, {"restitution", e}, {"wall", wall}});
    for (const int count : {5, 12}) {
      for (const bool linear : {false, true}) {
        LineProblem line = Push(first, second, count, linear);
        line.x << -1.5, -0.8, 1, 1;
        line.duration = 1.5;
        line.target << 0, -0.6, 0, 0.4;
        line.weight << 0, 2, 0, 1;
        TrajectoryOptions options;
        options.neighbours = true;
        const TrajectoryProblem problem = test::DiscsOf(line, 2 * first);
        const TrajectoryOptimum found = OptimizeTrajectory(*discs, problem, options);
        const Touchdowns met = TouchdownsOf(*discs, problem, found);
        const std::string which = std::to_string(first) + ", " + std::to_string(second) + ", " +
                                  std::to_string(count) + (linear ? " led" : " held");
        if (!IsMinimum(found)) {
          // The second disc meets the first and the wall at once: the order decides.
          EXPECT_NE(std::string::npos, found.message.find("not orthogonal")) << found.message;
          continue;
        }
        std::vector<LineProblem::Event> its;
        int collisions = 0;
        for (int contact : met.contacts) {
          const double n1 = contact == 1 ? -1 : 0, n2 = contact == 2 ? -1 : 0;
          collisions += contact == 0;
          its.push_back(contact == 0 ? LineProblem::Event{kBetween, -0.4, e}
                                     : LineProblem::Event{Eigen::Vector2d(n1, n2), wall - 0.2, 1});
        }
        twice += collisions >= 2;
        std::printf("%s: %d collisions of %zu touchdowns, %.9f\n", which.c_str(), collisions,
                    its.size(), found.cost);
        if (!its.empty()) CheckLocally(*discs, problem, line, its, met, found.cost, which);
      }
    }
  }
  EXPECT_GE(twice, 3);
}

/// A ball is thrown at the floor once and twice, to be at rest at 1 m.
TEST(Collisions, OfABallWithTheFloor) {
  for (const double e : {1.0, 0.8}) {
    for (const int bounces : {1, 2}) {
      for (const int count : {4, 10}) {
        for (const bool linear : {false, true}) {
          LineProblem line;
          line.mass = Vector::Ones(1);
          line.gravity = -9.8;
          line.x = Eigen::Vector2d(1, 0);
          line.duration = bounces == 1 ? 0.9 : 1.6;
          line.count = count;
          line.linear = linear;
          line.effort = 0.01;
          line.weight = Eigen::Vector2d(100, 10);
          line.target = Eigen::Vector2d(0.8, 0);
          const auto ball = MakeModel("driven_ball", {{"restitution", e}});
          TrajectoryOptions options;
          options.neighbours = true;
          const TrajectoryProblem problem = test::BallOf(line, 0);
          const TrajectoryOptimum found = OptimizeTrajectory(*ball, problem, options);
          const Touchdowns met = TouchdownsOf(*ball, problem, found);
          const std::string which =
              std::to_string(e) + ", " + std::to_string(count) + (linear ? " led" : " held");
          EXPECT_TRUE(IsMinimum(found)) << which << ": " << found.message;
          EXPECT_EQ(static_cast<std::size_t>(bounces), met.instants.size()) << which;
          const std::vector<LineProblem::Event> its(met.instants.size(), {Vector::Ones(1), 0, e});
          if (!its.empty()) CheckLocally(*ball, problem, line, its, met, found.cost, which);
        }
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
