// SPDX-License-Identifier: BSD-3-Clause
// Robots of more constraints than one machine word has bits.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

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
  constexpr int kCount = 100;
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
  EXPECT_NEAR(0, end(70), 1e-9);
  EXPECT_NEAR(1 + last - 1e-4, end(kCount - 1), 1e-9);
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

}  // namespace
}  // namespace contact_flow
