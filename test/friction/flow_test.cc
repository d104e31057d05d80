// SPDX-License-Identifier: BSD-3-Clause
// Runs with friction beside the same runs in quadruple precision.
#include <gtest/gtest.h>

#include "contact_flow/flow/simulate.h"
#include "test/friction/friction_case.h"

namespace contact_flow {
namespace {

class FrictionFlow : public testing::TestWithParam<std::string> {};

TEST_P(FrictionFlow, AgreesWithQuadruplePrecision) {
  const test::FrictionCase c(GetParam());
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  const Trajectory run = Simulate(*c.system, c.x, c.u, c.duration, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const int n = c.system->num_constraints();
  std::vector<std::string> words;
  for (const Arc& arc : run.arcs) words.push_back(arc.mode.Word(n));
  EXPECT_EQ(c.words, words);
  ASSERT_EQ(static_cast<std::size_t>(c.event_times.size()), run.transitions.size());
  for (std::size_t k = 0; k < run.transitions.size(); ++k) {
    const Transition& t = run.transitions[k];
    EXPECT_NEAR(c.event_times(static_cast<Eigen::Index>(k)), t.t, 1e-11);
    if (c.impulses[k].size() == 0) {
      EXPECT_TRUE(t.impulse.isZero(0));
      continue;
    }
    Eigen::Index at = 0;
    for (int i = 0; i < n; ++i) {
      const Friction& friction = c.system->friction()[i];
      EXPECT_NEAR(c.impulses[k](at++), t.impulse(i), 1e-10);
      for (int j = 0; j < friction.dimension; ++j) {
        EXPECT_NEAR(c.impulses[k](at++), t.impulse(friction.row + j), 1e-10);
      }
    }
    EXPECT_NEAR(c.energy_changes[k], t.energy_change, 1e-9);
  }
  EXPECT_LT((run.FinalState() - c.final_state).cwiseAbs().maxCoeff(), 1e-10);
}

INSTANTIATE_TEST_SUITE_P(Cases, FrictionFlow, testing::ValuesIn(test::FrictionCaseNames()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace contact_flow
