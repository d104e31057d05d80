// SPDX-License-Identifier: BSD-3-Clause
// Robots of more constraints than machine words have bits, and than sets keep in place.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "test/io/controlled_robots.h"

namespace contact_flow {
namespace {

using test::Joint;
using test::Link;
using test::Make;
using test::Robot;

/// `count` masses on vertical slides.
std::string Slides(int count) {
  std::string content;
  for (int k = 0; k < count; ++k) {
    const std::string name = "m" + std::to_string(k);
    content +=
        Link(name, "1") + Joint("j" + std::to_string(k), "prismatic", "world", name, "0 0 1");
  }
  return Robot(content);
}

double Height(int k) { return 0.05 + 0.003 * k; }

/// Each lands √(2h/g) after it is let go, and stays; δh changes no height in the end, and all but
/// the last one are down.
TEST(ManyConstraints, LandOneAfterTheOther) {
  constexpr int kCount = 150;
  std::string yaml = "base: fixed\ngravity: 10\nconstraints:\n";
  for (int k = 0; k < kCount; ++k) {
    yaml += "  c" + std::to_string(k) + ": {kind: plane, link: m" + std::to_string(k) +
            ", point: [0, 0, " + std::to_string(Height(k)) + "], restitution: 0}\n";
  }
  const RobotSystem robot = Make(Slides(kCount), yaml);
  const double last = std::sqrt(0.2 * Height(kCount - 1));
  const Trajectory run = Simulate(robot, Vector::Zero(2 * kCount), Vector::Zero(0), last - 1e-4);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(static_cast<std::size_t>(kCount - 1), run.transitions.size());
  for (int k = 0; k + 1 < kCount; ++k) {
    EXPECT_NEAR(std::sqrt(0.2 * Height(k)), run.transitions[k].t, 1e-9) << k;
    EXPECT_EQ(ConstraintSet({k}), run.transitions[k].activated) << k;
  }
  EXPECT_EQ(kCount - 1, run.arcs.back().mode.Size());
  EXPECT_FALSE(run.arcs.back().mode.Contains(kCount - 1));
  const BDerivative B = DifferentiateOutcome(robot, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const Vector end = B(Vector::Ones(2 * kCount));
  const std::vector<std::string>& names = robot.description().velocities;
  for (int k = 0; k < kCount; ++k) {
    const bool falls = names[k] == "j" + std::to_string(kCount - 1);
    EXPECT_NEAR(falls ? 1 + last - 1e-4 : 0, end(k), 1e-9) << names[k];
  }
}

/// A sliding body on its four lowest corners, of which the others never touch, is that body.
TEST(ManyConstraints, WithFrictionAreThoseThatTouch) {
  const std::string urdf = "<robot name=\"sledge\">" + Link("body", "2") + "</robot>";
  const auto corner = [](const std::string& name, double x, double y, double z) {
    return "  " + name + ": {kind: plane, link: body, point: [" + std::to_string(x) + ", " +
           std::to_string(y) + ", " + std::to_string(z) + "], friction: 0.4}\n";
  };
  std::string few = "base: floating\nconstraints:\n", many = few;
  for (int k = 0; k < 36; ++k) {
    many += corner("high" + std::to_string(k), 0.01 * k, 0, 0.5 + 0.01 * k);
  }
  for (int k = 0; k < 3; ++k) {
    const std::string low =
        corner("low" + std::to_string(k), k < 2 ? 0.2 : -0.2, k < 2 ? 0.2 - 0.4 * k : 0.05, -0.1);
    few += low;
    many += low;
  }
  const RobotSystem first = Make(urdf, few), second = Make(urdf, many);
  ASSERT_EQ(39, second.num_constraints());
  Vector x = first.nominal().x;
  x(2) = 0.13;
  x(7) = 0.8;
  x(8) = 0.3;
  const Trajectory one = Simulate(first, x, Vector::Zero(0), 0.4);
  const Trajectory other = Simulate(second, x, Vector::Zero(0), 0.4);
  ASSERT_TRUE(one.status.ok()) << one.status.message;
  ASSERT_TRUE(other.status.ok()) << other.status.message;
  EXPECT_GT(one.transitions.size(), 1u);
  EXPECT_EQ(one.transitions.size(), other.transitions.size());
  EXPECT_LT((one.FinalState() - other.FinalState()).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_EQ(one.arcs.back().mode.Word(3), other.arcs.back().mode.Word(39).substr(36));
}

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

/// It falls, slides and tips. Its contacts have indices, and their guards numbers, that sets keep
/// beyond those in place; nothing else differs from the box alone.
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
