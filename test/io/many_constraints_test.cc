// SPDX-License-Identifier: BSD-3-Clause
// A box falls, slides and tips beside hundreds of constraints that are far away: its contacts have
// indices, and their guards numbers, that sets keep beyond those in place; nothing else differs.
#include <algorithm>
#include <string>
#include <vector>

#include "test/io/controlled_robots.h"

namespace contact_flow {
namespace {

using test::Link;
using test::Make;

/// Four corners of the box on a floor, behind `far` planes a kilometre away; all with friction.
std::string Box(int far) {
  std::string yaml = "base: floating\nnominal: {positions: {base_z: 0.14}}\nconstraints:\n";
  for (int k = 0; k < far; ++k) {
    yaml += "  f" + std::to_string(k) + ": {kind: plane, link: m0, offset: -1000, friction: 0.5}\n";
  }
  for (const char* xy : {"0.2, 0.1", "0.2, -0.1", "-0.2, 0.1", "-0.2, -0.1"}) {
    yaml += "  c" + std::to_string(yaml.size()) + ": {kind: plane, link: m0, point: [" + xy +
            ", -0.1], friction: 0.4}\n";
  }
  return yaml;
}

struct Outcome {
  Trajectory run;
  Vector x, b;
};

Outcome Throw(int far) {
  const RobotSystem system = Make("<robot name=\"r\">" + Link("m0", "1") + "</robot>", Box(far));
  EXPECT_EQ(far + 4, system.num_constraints());
  const std::vector<std::string> names = system.description().velocities;
  Vector x = system.nominal().x, w = Vector::Zero(2 * system.dof());
  const auto rate = [&](const char* name) {
    return std::find(names.begin(), names.end(), name) - names.begin();
  };
  x(system.num_positions() + rate("base_x")) = 0.6;
  x(system.num_positions() + rate("base_wy")) = 1.3;
  x(system.num_positions() + rate("base_wx")) = 0.4;
  w(rate("base_z")) = 1;
  w(system.dof() + rate("base_x")) = -0.3;
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-10;
  Outcome outcome{Simulate(system, x, system.nominal().u, 1.2, options), {}, {}};
  EXPECT_TRUE(outcome.run.status.ok()) << outcome.run.status.message;
  outcome.x = outcome.run.FinalState();
  const BDerivative B = DifferentiateOutcome(system, outcome.run);
  EXPECT_TRUE(B.status.ok()) << B.status.message;
  if (B.status.ok()) outcome.b = B(w);
  return outcome;
}

TEST(ManyConstraints, ThatAreFarChangeNothing) {
  const Outcome alone = Throw(0);
  ASSERT_LT(2u, alone.run.transitions.size());
  for (int far : {39, 130, 400}) {
    const Outcome beside = Throw(far);
    ASSERT_EQ(alone.run.transitions.size(), beside.run.transitions.size()) << far;
    for (std::size_t k = 0; k < alone.run.transitions.size(); ++k) {
      const Transition &a = alone.run.transitions[k], &b = beside.run.transitions[k];
      EXPECT_NEAR(a.t, b.t, 1e-9);
      EXPECT_EQ(std::string(far, 'o') + a.mode_after.Word(4), b.mode_after.Word(far + 4));
    }
    EXPECT_LT((alone.x - beside.x).norm(), 1e-8) << far;
    EXPECT_LT((alone.b - beside.b).norm(), 1e-6 * alone.b.norm()) << far;
  }
}

}  // namespace
}  // namespace contact_flow
