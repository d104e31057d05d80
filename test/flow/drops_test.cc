// SPDX-License-Identifier: BSD-3-Clause
// Random level and tilted drops of robots of public proportions run to their end.
// CONTACT_FLOW_DROPS=200 drops that many of each.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

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

class Drops : public testing::TestWithParam<const char*> {};

TEST_P(Drops, RunToTheirEnd) {
  const auto system =
      LoadRobot(std::string(CONTACT_FLOW_TEST_DATA) + "/drop_" + GetParam() + ".yaml");
  const int nq = system->num_positions(), d = system->dof();
  for (int seed = 0; seed < NumDrops(); ++seed) {
    const Trajectory run =
        Simulate(*system, RandomDrop(*system, seed), system->nominal().u, 1.0);
    EXPECT_TRUE(run.status.ok()) << "seed " << seed << ": " << run.status.message;
    EXPECT_EQ(1.0, run.t_end());
    double deepest = 0;
    ConstraintTerms terms;
    for (double t = 0; t < run.t_end(); t += 1e-3) {
      const Vector x = run.State(t);
      system->Constraints(x.head(nq), x.tail(d), &terms);
      deepest = std::min(deepest, terms.gap.minCoeff());
    }
    // Contacts that rest drift within the integrator's tolerance, 1e-9 a step.
    EXPECT_GT(deepest, -1e-7) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, Drops, testing::Values("quadruped", "humanoid"));

}  // namespace
}  // namespace contact_flow
