// SPDX-License-Identifier: BSD-3-Clause
// Random level and tilted drops of robots of public proportions run to their end.
// CONTACT_FLOW_DROPS=200 drops that many of each.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/random_drop.h"

namespace contact_flow {
namespace {

int NumDrops() {
  const char* asked = std::getenv("CONTACT_FLOW_DROPS");
  return asked != nullptr ? std::atoi(asked) : 8;
}

/// How deep contacts are at most, every millisecond.
double Deepest(const MechanicalSystem& system, const Trajectory& run) {
  double deepest = 0;
  ConstraintTerms terms;
  for (double t = 0; t < run.t_end(); t += 1e-3) {
    const Vector x = run.State(t);
    system.Constraints(x.head(system.num_positions()), x.tail(system.dof()), &terms);
    deepest = std::min(deepest, terms.gap.minCoeff());
  }
  return deepest;
}

class Drops : public testing::TestWithParam<const char*> {};

TEST_P(Drops, RunToTheirEnd) {
  const auto system = LoadRobot(DropFile(GetParam()));
  for (int seed = 0; seed < NumDrops(); ++seed) {
    const Trajectory run = Simulate(*system, RandomDrop(*system, seed), system->nominal().u, 1.0);
    EXPECT_TRUE(run.status.ok()) << "seed " << seed << ": " << run.status.message;
    EXPECT_EQ(1.0, run.t_end());
    // Contacts that rest drift within the integrator's tolerance, 1e-9 a step.
    EXPECT_GT(Deepest(*system, run), -1e-7) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, Drops, testing::Values("quadruped", "humanoid"));

/// The same with friction 0.8: point feet that slip, stick and let go; flat feet that land level,
/// whose shares decide; stiff ones, whose tiny slips jam. With CONTACT_FLOW_DROPS outcomes are
/// counted, as not all of so many end.
TEST(DropsWithFriction, RunToTheirEnd) {
  const struct {
    const char* robot;
    std::vector<int> seeds;
  } drops[] = {{"quadruped", {0, 1, 2, 3, 4}},
               {"humanoid", {0, 9, 15, 26, 71, 98, 99, 122, 157, 158, 2063, 2070, 2159}}};
  const bool count = std::getenv("CONTACT_FLOW_DROPS") != nullptr;
  for (const auto& drop : drops) {
    RobotTexts texts = ReadRobotTexts(DropFile(drop.robot));
    AddFriction(0.8, &texts.yaml);
    const auto system = MakeRobot(texts);
    ASSERT_TRUE(system->HasFriction());
    std::vector<int> seeds = drop.seeds;
    for (int seed = 0; count && seed < NumDrops(); ++seed) seeds.push_back(seed);
    SimulateOptions options;
    options.method = IntegrationMethod::kAutomatic;
    options.max_seconds = 20;
    std::map<std::string, int> outcomes;
    for (std::size_t k = 0; k < seeds.size(); ++k) {
      const Trajectory run =
          Simulate(*system, RandomDrop(*system, seeds[k]), system->nominal().u, 1.0, options);
      EXPECT_GT(Deepest(*system, run), -1e-7) << drop.robot << ' ' << seeds[k];
      if (k < drop.seeds.size()) {
        EXPECT_TRUE(run.status.ok()) << drop.robot << ' ' << seeds[k] << ": " << run.status.message;
      } else {
        ++outcomes[OutcomeName(run.status.outcome)];
      }
    }
    for (const auto& [outcome, number] : outcomes) {
      std::printf("%s: %d %s\n", drop.robot, number, outcome.c_str());
    }
  }
}

/// Left toes throw right ones up, ever again, and at last no letters fit: what is slow comes to
/// rest, which is told, and has no derivative.
TEST(DropsWithFriction, WhatIsSlowSettlesWhereNoMotionFits) {
  RobotTexts texts = ReadRobotTexts(DropFile("humanoid"));
  AddFriction(0.8, &texts.yaml);
  const auto system = MakeRobot(texts);
  SimulateOptions options;
  options.method = IntegrationMethod::kAutomatic;
  const Trajectory run =
      Simulate(*system, RandomDrop(*system, 2151), system->nominal().u, 0.53, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const auto at = std::find_if(
      run.transitions.begin(), run.transitions.end(), [](const Transition& transition) {
        return transition.obstacle.message.find("taken to rest, which") != std::string::npos &&
               transition.obstacle.message.find("speeds of contacts") != std::string::npos;
      });
  ASSERT_NE(run.transitions.end(), at);
  const int d = system->dof(), nq = system->num_positions();
  ConstraintTerms terms;
  system->Constraints(at->x_plus.head(nq), at->x_plus.tail(d), &terms);
  const Vector change = terms.jacobian * (at->x_plus - at->x_minus).tail(d);
  const Vector rate = terms.jacobian * at->x_plus.tail(d);
  for (int i : at->mode_after) {
    EXPECT_NEAR(0, rate(i), 1e-12);
    EXPECT_LE(std::abs(change(i)), 1e-4);
    const Friction& friction = system->friction()[i];
    if (at->mode_after.LetterOf(i) != Letter::kStick) continue;
    EXPECT_LE(rate.segment(friction.row, 2).norm(), 1e-12);
    EXPECT_LE(change.segment(friction.row, 2).norm(), 1e-4);
  }
  const bool told =
      std::any_of(run.warnings.begin(), run.warnings.end(),
                  [&](const Warning& warning) { return warning.message == at->obstacle.message; });
  EXPECT_TRUE(told || run.num_warnings > Trajectory::kMaxWarnings);
  EXPECT_FALSE(DifferentiateOutcome(*system, run).status.ok());
}

/// As a slip jams, the force of another foot passes its cone within the last digit of time, in one
/// of ten runs from shortly before, of other tolerances: it is told, and has no derivative.
TEST(DropsWithFriction, ForcesThatPassTheirBoundsTooQuicklyAreTold) {
  RobotTexts texts = ReadRobotTexts(DropFile("humanoid"));
  AddFriction(0.8, &texts.yaml);
  const auto system = MakeRobot(texts);
  const double before = 0.705, end = 0.72;
  const Vector u = system->nominal().u;
  const Vector x = Simulate(*system, RandomDrop(*system, 2070), u, before).FinalState();
  const auto passed = [](const Transition& transition) {
    return transition.obstacle.message.find("pass their bounds") != std::string::npos;
  };
  Trajectory run;
  auto at = run.transitions.end();
  for (int k = 0; k < 100 && at == run.transitions.end(); ++k) {
    SimulateOptions options;
    options.relative_tolerance = 1e-9 * (1 + 0.01 * k);
    run = Simulate(*system, x, u, end - before, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    at = std::find_if(run.transitions.begin(), run.transitions.end(), passed);
  }
  ASSERT_NE(run.transitions.end(), at);
  EXPECT_EQ(Outcome::kPainleveCrossing, at->obstacle.outcome) << at->obstacle.message;
  EXPECT_FALSE(at->mode_after == at->mode_before);
  EXPECT_TRUE(std::any_of(run.warnings.begin(), run.warnings.end(), [&](const Warning& warning) {
    return warning.message == at->obstacle.message;
  }));
  EXPECT_FALSE(DifferentiateOutcome(*system, run).status.ok());
}

}  // namespace
}  // namespace contact_flow
