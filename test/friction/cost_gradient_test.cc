// SPDX-License-Identifier: BSD-3-Clause
// The gradient of a cost with friction beside one-sided quotients in quadruple precision.
#include "contact_flow/derivative/cost_gradient.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/model/model_system.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "test/friction/friction_case.h"
#include "test/friction/robot_twins.h"
#include "test/friction/systems/tips.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

/// A covector of the final state, without symmetries.
RunCost Covector(const Vector& c) {
  RunCost cost;
  cost.terminal = [c](const Vector& x, Vector* by_state) {
    *by_state = c;
    return c.dot(x);
  };
  return cost;
}

Vector Random(Eigen::Index size) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Vector::NullaryExpr(size, [&] { return uniform(random); });
}

BDerivativeOptions Options(std::vector<int> parameters = {}) {
  BDerivativeOptions options;
  options.tolerance = 1e-11;
  options.variables.parameters = std::move(parameters);
  return options;
}

/// Tolerances as of the forward derivative beside the same quotients, 1e-8, for sums of a few.
TEST(CostGradientWithFriction, AgreesWithReferences) {
  int compared = 0;
  for (const std::string& name : test::FrictionCaseNames()) {
    const test::FrictionCase c(name);
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    const Trajectory run = Simulate(*c.system, c.x, c.u, c.duration, options);
    if (!run.status.ok()) continue;
    const Vector covector = Random(c.system->state_size());
    double scale = 1;
    for (const auto& d : c.derivatives) scale = std::max(scale, d.derivative.cwiseAbs().maxCoeff());
    const std::size_t count = std::min<std::size_t>(3, c.derivatives.size());
    for (std::size_t k = 0; k < count; ++k) {
      const auto& d = c.derivatives[k * c.derivatives.size() / count];
      RunDirection w;
      w.initial = d.direction;
      const CostGradient J = DifferentiateCost(*c.system, run, Covector(covector), Options(), &w);
      ASSERT_TRUE(J.status.ok()) << name << ": " << J.status.message;
      // Tangents by numbers, as these systems have no rotations.
      ASSERT_EQ(c.system->state_size(), d.derivative.size());
      EXPECT_NEAR(covector.dot(d.derivative), J.Along(w), 3e-8 * scale)
          << name << " along " << d.direction.transpose();
      ++compared;
    }
    for (const auto& p : c.by_parameters) {
      const auto index = ParameterIndices(c.system->description(), {p.parameter});
      if (p.parameter[0] == 'g' && p.sign > 0) continue;  // made elastic: another motion
      RunDirection w;
      w.parameters = Vector::Constant(1, p.sign);
      const CostGradient J =
          DifferentiateCost(*c.system, run, Covector(covector), Options(index), &w);
      ASSERT_TRUE(J.status.ok()) << name << ": " << J.status.message;
      const double size = std::max(1.0, p.derivative.cwiseAbs().maxCoeff());
      EXPECT_NEAR(covector.dot(p.derivative), J.Along(w), 3e-8 * size) << name << p.parameter;
      ++compared;
    }
  }
  EXPECT_GT(compared, 30);
}

/// J = ½ ∫ r u² dt changes by ½ r (u₀² − u₁²) with the instant of the grid, whatever moves: also
/// where a slip ends there, and goes on or not.
TEST(CostGradientWithFriction, ByAnInstantAtWhichASlipEnds) {
  const auto block = MakeModel("block_on_incline",
                               {{"incline", 0}, {"gravity", 10}, {"friction", 0.5}, {"mass", 1}});
  constexpr double kStop = 0.4, kEnd = 0.9, kWeight = 1.5;
  Vector x = Vector::Zero(6);
  x(3) = 2;
  x(5) = 1;  // the clock
  QuadraticCost effort;
  effort.input_weight = Vector::Constant(1, kWeight);
  for (const double push : {8.0, 3.0, -3.0, -7.0}) {
    const Vector none = Vector::Zero(1), f = Vector::Constant(1, push);
    const Trajectory run = Simulate(*block, x, {{0, kStop}, {none, f}}, kEnd, test::Tight());
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    for (const double faster : {1.0, -1.0}) {
      RunDirection w;
      w.initial = faster * Vector::Unit(6, 3);
      const CostGradient J = DifferentiateCost(*block, run, effort.Make(*block), Options(), &w);
      ASSERT_TRUE(J.status.ok()) << push << ": " << J.status.message;
      ASSERT_EQ(1, J.instants.size());
      EXPECT_NEAR(-kWeight * push * push / 2, J.instants(0), 1e-9) << push << ", " << faster;
    }
  }
}

/// Two masses fall from h and land at once: J = ½ ∫ s v² dt = s g² τ³/6, τ = √(2h/g), of each.
TEST(CostGradientWithFriction, OfSpeedsThatEndInTwoLandingsAtOnce) {
  constexpr double kGravity = 10, kHeight = 0.2;
  const double tau = std::sqrt(2 * kHeight / kGravity);
  const auto tips = MakeSystem<test::Tips<2>>(
      {{"f0", 0}, {"f1", -kGravity}, {"f2", 0}, {"f3", -kGravity}, {"mu0", 0.5}, {"mu1", 0.4}});
  Vector x = Vector::Zero(8);
  x(1) = x(3) = kHeight;
  QuadraticCost speed;
  speed.state_weight = Vector::Zero(8);
  speed.state_weight(5) = 1;
  speed.state_weight(7) = 3;
  const Trajectory run = Simulate(*tips, x, Vector(), 0.5, test::Tight());
  ASSERT_EQ(1u, run.transitions.size());
  ASSERT_EQ(2, run.transitions[0].activated.Size());
  const CostGradient J = DifferentiateCost(*tips, run, speed.Make(*tips), Options());
  ASSERT_TRUE(J.status.ok()) << J.status.message;
  EXPECT_NEAR(1 * kGravity * tau / 2, J.initial(1), 1e-8);
  EXPECT_NEAR(3 * kGravity * tau / 2, J.initial(3), 1e-8);
}

/// A mass is pulled off the floor by a spring whose other end rises: what it costs to touch ends at
/// an instant of its own, or, where the input changes at that instant, at the first of the two.
TEST(CostGradientWithFriction, OfWhatALiftOffEndsIsRefusedWhereTheInputChanges) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const auto robot = test::Robot(
      "<robot name='r'><link name='world'/>" + test::OnSlides("low", 1) +
          test::OnSlides("high", 1) + "</robot>",
      "{base: fixed, gravity: 10, constraints: {floor: {kind: plane, link: low, point: [0, 0, 0], "
      "friction: 0.5}}, efforts: {up: {kind: actuator, joint: high_z, input: u}, spring: {kind: "
      "point_spring, link: low, point: [0, 0, 0], other_link: high, other_point: [0, 0, 1], "
      "length: 1, stiffness: 40, damping: 0}}}");
  Vector x = Vector::Zero(12);
  x(8) = 1;  // joints are in the order of their names
  RunCost touch;
  touch.running_in_mode = [](double, const Vector&, const Vector&, ContactMode mode,
                             CostRate* rate) {
    rate->value = mode.Contains(0) ? 1 : 0;
    rate->by_state.setZero();
    rate->by_input.setZero();
  };
  const auto gradient = [&](const InputSchedule& inputs) {
    const Trajectory run = Simulate(*robot, x, inputs, 0.4, test::Tight());
    EXPECT_EQ("o", run.arcs.back().mode.Word(1)) << run.status.message;
    return DifferentiateCost(*robot, run, touch, Options());
  };
  const InputSchedule held{{0}, {Vector::Constant(1, 30)}};
  const Trajectory run = Simulate(*robot, x, held, 0.4, test::Tight());
  ASSERT_EQ(1u, run.transitions.size());
  const CostGradient alone = gradient(held);
  ASSERT_TRUE(alone.status.ok()) << alone.status.message;
  constexpr double kStep = 1e-5;
  const auto lets_go = [&](double faster) {
    Vector moved = x;
    moved(8) += faster;
    return Simulate(*robot, moved, held, 0.4, test::Tight()).transitions.at(0).t;
  };
  EXPECT_NEAR((lets_go(kStep) - lets_go(-kStep)) / (2 * kStep), alone.initial(8), 1e-7);
  const CostGradient J =
      gradient({{0, run.transitions[0].t}, {Vector::Constant(1, 30), Vector::Constant(1, 20)}});
  EXPECT_FALSE(J.status.ok());
  EXPECT_NE(std::string::npos, J.status.message.find("floor")) << J.status.message;
}

}  // namespace
}  // namespace contact_flow
