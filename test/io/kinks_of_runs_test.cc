// SPDX-License-Identifier: BSD-3-Clause
// Runs whose outcome has two slopes where nothing jumps: they end right at a change of the mode, or
// an effort stays right on its limit. Beside closed forms of the two sides.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/derivative/linearization.h"
#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/model/linear_inputs.h"
#include "test/io/moving_robots.h"

namespace contact_flow {
namespace {

using test::Ball;
using test::Block;
using test::ExpectRefused;
using test::Make;
using test::Tight;

/// Of a run by the state, and by inputs and all parameters where these are asked for.
BDerivative Differentiate(const RobotSystem& system, double duration, bool inputs = false,
                          std::vector<int> parameters = {},
                          const SimulateOptions& options = SimulateOptions()) {
  BDerivativeOptions derivative;
  derivative.variables.inputs = inputs;
  derivative.variables.parameters = std::move(parameters);
  const Vector x = system.nominal().x, u = system.nominal().u;
  return DifferentiateOutcome(system, Simulate(system, x, u, duration, options), derivative);
}
/// (x(T) − x₀(T))/α from a start moved by α w.
Vector Quotient(const RobotSystem& system, double duration, double alpha, const Vector& w) {
  const auto end = [&](const Vector& moved) {
    const Vector x = system.Perturb(system.nominal().x, moved);
    return Simulate(system, x, system.nominal().u, duration, Tight()).FinalState();
  };
  return (end(alpha * w) - end(0 * w)) / alpha;
}

/// 1 kg that slides at 1 m/s, pressed by 4 N with coefficient 1: v = 1 m/s − 4 m/s² t.
RobotSystem SlidingBlock() {
  return Make(Block(),
              "{base: fixed, gravity: 8, constraints: {floor: {kind: plane, link: block, point: "
              "[0, 0, 0], friction: 1}}, parameters: {mu: floor/friction}, "
              "nominal: {velocities: {x: 1}}}");
}
constexpr double kStop = 0.25;

/// v(T) = max(0, v₀ − 4 T) around v₀ = 4 T: slope 1 above, 0 below.
TEST(KinkAtTheEnd, OfASlipThatStops) {
  const RobotSystem block = SlidingBlock();
  const Vector w = Vector::Unit(4, 2);
  EXPECT_NEAR(1, Quotient(block, kStop, 1e-4, w)(2), 1e-6);
  EXPECT_NEAR(0, Quotient(block, kStop, 1e-4, -w)(2), 1e-6);
  for (const double apart : {0.0, 1e-13, -1e-13, 1e-10, -1e-10}) {
    const BDerivative B = Differentiate(block, kStop + apart);
    ExpectRefused(B.status, "'floor' changes its mode at t = 0.25");
    EXPECT_THROW(B(w), std::domain_error);
    ExpectRefused(Differentiate(block, kStop + apart, false, {0}).status, "'floor'");
  }
  for (const double apart : {1e-6, -1e-6}) {
    const BDerivative B = Differentiate(block, kStop + apart);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    for (const double sign : {1.0, -1.0}) {
      EXPECT_NEAR(apart > 0 ? 0 : sign, B(sign * w)(2), 1e-9) << apart;
    }
  }
}

/// The same in space, where a stop is no change of a sign: pressed by 8 N with coefficient ½, 2 kg.
TEST(KinkAtTheEnd, OfASlipInSpaceThatStops) {
  using test::Joint;
  using test::Link;
  const RobotSystem puck =
      Make(test::Robot(Link("a", "0.5") + Link("b", "0.5") + Link("puck", "1") +
                       Joint("x", "prismatic", "world", "a", "1 0 0") +
                       Joint("y", "prismatic", "a", "b", "0 1 0") +
                       Joint("z", "prismatic", "b", "puck", "0 0 1")),
           "{base: fixed, gravity: 8, constraints: {floor: {kind: plane, link: puck, point: "
           "[0, 0, 0], friction: 0.5}}, nominal: {velocities: {x: 1}}}");
  const double stop = 0.5;
  const Vector w = Vector::Unit(6, 3);
  EXPECT_NEAR(1, Quotient(puck, stop, 1e-4, w)(3), 1e-4);
  EXPECT_NEAR(0, Quotient(puck, stop, 1e-4, -w)(3), 1e-4);
  for (const SimulateOptions& options : {SimulateOptions(), Tight()}) {
    for (const double apart : {0.0, 1e-15, -1e-15, 1e-13, -1e-13}) {
      ExpectRefused(Differentiate(puck, stop + apart, false, {}, options).status,
                    "'floor' changes its mode at t = 0.");
    }
    for (const double apart : {1e-6, -1e-6}) {
      const BDerivative B = Differentiate(puck, stop + apart, false, {}, options);
      ASSERT_TRUE(B.status.ok()) << B.status.message;
      EXPECT_NEAR(apart > 0 ? 0 : 1, B(w)(3), 1e-6) << apart;
    }
  }
}

TEST(KinkAtTheEnd, OfGradientsIntervalsAndReadings) {
  const RobotSystem block = SlidingBlock();
  const Vector x = block.nominal().x;
  const Trajectory run = Simulate(block, x, Vector(0), kStop);
  RunCost cost;
  cost.terminal = [](const Vector& end, Vector* gradient) {
    *gradient = Vector::Unit(4, 2);
    return end(2);
  };
  ExpectRefused(DifferentiateCost(block, run, cost).status, "'floor'");
  ExpectRefused(Linearize(block, run).back().status, "'floor'");
  const SimulateOptions options;
  const std::shared_ptr<const RobotSystem> shared(new RobotSystem(SlidingBlock()));
  OnlineFlow flow(shared, 0, x, Vector(0), options);
  RollingDerivative rolling(&flow, Vector::Unit(4, 2), {}, options);
  for (const double apart : {-1e-3, 0.0, 1e-3}) {
    bool passed = true;
    while (passed) {
      passed = flow.AdvanceTo(kStop + apart);
      rolling.Follow(&flow, passed);
    }
    const Status status = rolling.Read(&flow).status;
    if (apart == 0) {
      ExpectRefused(status, "'floor'");
    } else {
      EXPECT_TRUE(status.ok()) << status.message;
    }
  }
}

/// What holds without limit lets go of a force: 1 N of 1 kg. What has a coefficient slips first.
TEST(KinkAtTheEnd, OfAContactWithoutSlipThatLetsGo) {
  const RobotSystem block =
      Make(Block(),
           "{base: fixed, gravity: 8, constraints: {floor: {kind: plane, link: block, point: "
           "[0, 0, 0], friction: no_slip}}, efforts: {push: {kind: constant_force, link: block, "
           "point: [0, 0, 0], force: [1, 0, 0]}, pull: {kind: track, joint: z, feed_forward: u, "
           "stiffness: 40, damping: 0, reference: {times: [0, 1], values: [0, 0.2]}}}}");
  const double release = 0.5;  // half way 40 N/m pull by 0.1 m, the weight of 0.5 kg
  ExpectRefused(Differentiate(block, release).status, "'floor' changes its mode at t = 0.5");
  EXPECT_TRUE(Differentiate(block, release + 1e-3).status.ok());
  EXPECT_TRUE(Differentiate(block, release - 1e-3).status.ok());
}

/// 1 kg that its drive just holds: 10 N at standstill, less by 5 N s/m upward, no more downward.
TEST(RestingOnALimit, WhereTheSpeedLimitBegins) {
  const RobotSystem held =
      Make(Ball(),
           "{base: fixed, gravity: 10, efforts: {a: {kind: actuator, joint: z, input: u, limit: "
           "10, speed: 2}}, parameters: {g: gravity}, nominal: {inputs: {u: 30}}}");
  const Vector w = Vector::Unit(2, 1);
  EXPECT_NEAR(std::exp(-5), Quotient(held, 1, 1e-4, w)(1), 1e-6);
  EXPECT_NEAR(-1, Quotient(held, 1, 1e-4, -w)(1), 1e-6);
  ExpectRefused(Differentiate(held, 1).status, "the effort 'a");
  ExpectRefused(Differentiate(held, 1, false, {0}).status, "the effort 'a");
}

/// 3 · 0.1 N, which is 0.3 N but for rounding. By what does not move it there is a derivative.
TEST(RestingOnALimit, OfAnInput) {
  const RobotSystem driven =
      Make(Ball(),
           "{base: fixed, gravity: 10, efforts: {a: {kind: actuator, joint: z, input: u, gear: 3, "
           "limit: 0.3}}, parameters: {g: gravity, most: a/limit}, nominal: {inputs: {u: 0.1}}}");
  ExpectRefused(Differentiate(driven, 1, true).status, "the effort 'a' is right on its limit");
  ExpectRefused(Differentiate(driven, 1, false, {1}).status,
                "the effort 'a' is right on its limit");
  const BDerivative B = Differentiate(driven, 1, false, {0});
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_TRUE(B(Vector::Unit(3, 1)).isApprox(Vector::Ones(2), 1e-9));
  EXPECT_TRUE(B(Vector::Unit(3, 2)).isApprox(Eigen::Vector2d(-0.5, -1), 1e-9));
}

/// A ramp that reaches the limit just where it turns is on it for an instant: v(T) = ∫ min(u, 1) dt
/// has one slope by the input there, half the length of each interval in which u is below.
TEST(RestingOnALimit, ForAnInstantIsNone) {
  const std::shared_ptr<const RobotSystem> ball(new RobotSystem(
      Make(Ball(),
           "{base: fixed, gravity: 0, efforts: {a: {kind: actuator, joint: z, input: u, limit: "
           "1}}}")));
  const LinearInputs led(ball);
  RunCost cost;
  cost.terminal = [](const Vector& end, Vector* gradient) {
    *gradient = Vector::Unit(4, 2);
    return end(2);
  };
  const std::vector<double> times = {0, 0.375, 1.35};
  for (const double before : {0.5, 2.0, 0.0}) {
    for (const double behind : {-0.5, 0.3, 1.5}) {
      const std::vector<double> nodes = {before, 1, behind};
      InputSchedule inputs;
      for (int k = 0; k < 2; ++k) {
        inputs.grid.push_back(times[k]);
        inputs.values.push_back(LinearInputs::Held(times[k], times[k + 1] - times[k],
                                                   Vector::Constant(1, nodes[k]),
                                                   Vector::Constant(1, nodes[k + 1])));
      }
      const Trajectory run =
          Simulate(led, led.State(Vector::Zero(2), 0), inputs, times[2], Tight());
      BDerivativeOptions options;
      options.variables.inputs = true;
      const CostGradient slope = DifferentiateCost(led, run, cost, options);
      ASSERT_TRUE(slope.status.ok()) << before << " " << behind << slope.status.message;
      const double first = times[1], second = times[2] - times[1];
      const double by_node =
          slope.inputs(1, 0) / first + slope.inputs(0, 1) - slope.inputs(1, 1) / second;
      EXPECT_NEAR((before < 1 ? first / 2 : 0) + (behind < 1 ? second / 2 : 0), by_node, 1e-9)
          << before << " " << behind;
    }
  }
}

/// 1 kg at rest on the floor, whose drive rises to its limit, the weight, in half of the time, and
/// stays: nothing presses the floor then. A higher limit lifts it, v(1) = ½ δ, a lower one never.
TEST(RestingOnALimit, ThatJustBearsTheWeight) {
  const auto raised = [](double limit) {
    return std::shared_ptr<const RobotSystem>(new RobotSystem(
        Make(Ball(),
             "{base: fixed, gravity: 10, constraints: {floor: {kind: plane, link: ball, "
             "point: [0, 0, 0]}}, efforts: {a: {kind: actuator, joint: z, input: u, limit: " +
                 test::Text(limit) + "}}, parameters: {most: a/limit}}")));
  };
  for (const double limit : {10.0, 9.5, 12.0}) {
    const LinearInputs led(raised(limit));
    const Vector held = LinearInputs::Held(0, 1, Vector::Zero(1), Vector::Constant(1, 20));
    const Trajectory run = Simulate(led, led.State(Vector::Zero(2), 0), held, 1, Tight());
    BDerivativeOptions options;
    options.variables.parameters = {0};
    const BDerivative B = DifferentiateOutcome(led, run, options);
    if (limit == 10) {
      ExpectRefused(B.status, "'floor' touches, and is neither pressed nor lifted");
      continue;
    }
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    EXPECT_NEAR(limit > 10 ? 1 - limit / 20 : 0, B(Vector::Unit(5, 4))(2), 1e-8) << limit;
  }
}

/// A block whose drive bears just the weight of 0.5 kg, after a plastic landing at 1 m/s, with and
/// without friction and slip: with more it flies, with less the floor takes the rest.
TEST(IdleOnTheFloor, WithFriction) {
  for (const std::string friction : {"0", "0.5", "no_slip"}) {
    for (const double slip : {0.0, 1.0}) {
      for (const double off : {0.0, 1e-3, -1e-3}) {
        const RobotSystem block =
            Make(Block(),
                 "{base: fixed, gravity: 10, constraints: {floor: {kind: plane, link: block, "
                 "point: [0, 0, 0], friction: " +
                     friction +
                     "}}, efforts: {a: {kind: actuator, joint: z, input: u}}, nominal: "
                     "{positions: {z: 0.5}, velocities: {x: " +
                     test::Text(slip) + ", z: -1}, inputs: {u: " + test::Text(5 + off) + "}}}");
        const BDerivative B = Differentiate(block, 1, true);
        if (off == 0) {
          ExpectRefused(B.status, "'floor' touches, and is neither pressed nor lifted");
          EXPECT_TRUE(Differentiate(block, 1).status.ok()) << friction << slip;
          continue;
        }
        ASSERT_TRUE(B.status.ok()) << B.status.message;
        // v_z(1 s) = (u − 5 N)/m t from the landing at ½ s on, which moves by the force, too.
        EXPECT_NEAR(off > 0 ? 1 : 0, B(Vector::Unit(5, 4))(3), 1e-2) << friction << slip;
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
