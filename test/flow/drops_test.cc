// SPDX-License-Identifier: BSD-3-Clause
// Random level and tilted drops of robots of public proportions run to their end.
// CONTACT_FLOW_DROPS=200 drops that many of each.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

int NumDrops() {
  const char* asked = std::getenv("CONTACT_FLOW_DROPS");
  return asked != nullptr ? std::atoi(asked) : 8;
}

/// The state with the lowest contact point up to 0.5 m above the ground; every fourth is level, the
/// others are tilted by up to 0.5 rad about any horizontal axis, with up to 0.1 rad on each joint.
Vector RandomDrop(const MechanicalSystem& system, int seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const int nq = system.num_positions(), d = system.dof();
  const double height = 0.25 * (1 + uniform(generator));
  const double tilt = 0.5 * std::abs(uniform(generator)), heading = M_PI * uniform(generator);
  Vector w = Vector::Zero(2 * d);
  if (seed % 4 != 0) {
    w(3) = tilt * std::cos(heading);
    w(4) = tilt * std::sin(heading);
    for (int j = 6; j < d; ++j) w(j) = 0.1 * uniform(generator);
  }
  Vector x = system.Perturb(system.nominal().x, w);
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  x(2) += height - terms.gap.minCoeff();
  return x;
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

std::string YamlOf(const std::string& robot) {
  return std::string(CONTACT_FLOW_TEST_DATA) + "/drop_" + robot + ".yaml";
}

class Drops : public testing::TestWithParam<const char*> {};

TEST_P(Drops, RunToTheirEnd) {
  const auto system = LoadRobot(YamlOf(GetParam()));
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
/// whose shares decide. With CONTACT_FLOW_DROPS outcomes are counted, as not all of so many end.
TEST(DropsWithFriction, RunToTheirEnd) {
  const struct {
    const char* robot;
    std::vector<int> seeds;
  } drops[] = {{"quadruped", {0, 1, 2, 3, 4}}, {"humanoid", {0, 3, 4, 7, 8, 9, 15, 26}}};
  const bool count = std::getenv("CONTACT_FLOW_DROPS") != nullptr;
  for (const auto& drop : drops) {
    RobotTexts texts = ReadRobotTexts(YamlOf(drop.robot));
    for (std::size_t at = 0; (at = texts.yaml.find(", radius:", at)) != std::string::npos;
         at += 20) {
      texts.yaml.insert(at, ", friction: 0.8");
    }
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

}  // namespace
}  // namespace contact_flow
