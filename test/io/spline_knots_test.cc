// SPDX-License-Identifier: BSD-3-Clause
// Robots that follow cubic splines and stand on them: steps end at the knots, and the derivative is
// that of central quotients, which do not know of knots: the outcome is smooth by the start where
// the run crosses them.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "contact_flow/flow/corner_functions.h"
#include "contact_flow/model/linear_inputs.h"
#include "src/model/natural_spline.h"
#include "test/io/moving_robots.h"

namespace contact_flow {
namespace {

using test::Arm;
using test::Block;
using test::Cart;
using test::Make;
using test::Tight;

const std::string kReference =
    "reference: {times: [-0.04, 0.11, 0.3, 0.42, 0.7], values: [0.3, -0.4, 0.6, -0.1, 0.2]}";
const std::string kLap =
    "reference: {times: [0, 0.07, 0.15, 0.26], values: [0.3, -0.4, 0.6, 0.3], periodic: true}";

/// D(h) = (φ(x + h w) − φ(x − h w))/2h at h and h/2, extrapolated: (4 D(h/2) − D(h))/3 [2d × 2d].
Matrix ByQuotients(const RobotSystem& system, double duration, const SimulateOptions& options) {
  const Vector x = system.nominal().x;
  const int n = 2 * system.dof();
  const auto quotient = [&](int k, double h) -> Vector {
    Vector end[2];
    for (const int side : {0, 1}) {
      const Vector w = (side == 0 ? h : -h) * Vector::Unit(n, k);
      const Trajectory run =
          Simulate(system, system.Perturb(x, w), system.nominal().u, duration, options);
      EXPECT_TRUE(run.status.ok()) << run.status.message;
      end[side] = run.FinalState();
    }
    return (end[0] - end[1]) / (2 * h);
  };
  constexpr double kStep = 1e-3;
  Matrix derivative(n, n);
  for (int k = 0; k < n; ++k) {
    // Of fourth order each, and the terms of sixth.
    const Vector one = quotient(k, kStep), two = quotient(k, kStep / 2);
    const Vector four = quotient(k, kStep / 4);
    const Vector coarse = (4 * two - one) / 3, fine = (4 * four - two) / 3;
    derivative.col(k) = (16 * fine - coarse) / 15;
  }
  return derivative;
}

/// B beside quotients, by both methods of integration; its stated error is small, too.
void ExpectRight(const std::string& urdf, const std::string& yaml, double duration,
                 bool constant_mode = true) {
  const RobotSystem system = Make(urdf, yaml);
  const Matrix truth = ByQuotients(system, duration, Tight());
  for (const IntegrationMethod method :
       {IntegrationMethod::kExplicit, IntegrationMethod::kImplicit}) {
    SimulateOptions options = Tight();
    options.method = method;
    const Trajectory run =
        Simulate(system, system.nominal().x, system.nominal().u, duration, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    EXPECT_EQ(constant_mode, run.transitions.empty());
    BDerivativeOptions by;
    by.tolerance = 1e-10;
    const BDerivative B = DifferentiateOutcome(system, run, by);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    for (Eigen::Index k = 0; k < truth.cols(); ++k) {
      const Vector column = B(Vector::Unit(truth.cols(), k));
      EXPECT_LE((column - truth.col(k)).norm(), 1e-7 * (1 + column.norm()))
          << yaml << "\n"
          << k << ": " << column.transpose() << "\n"
          << truth.col(k).transpose();
    }
  }
}

TEST(SplineKnots, OfReferencesAndGusts) {
  for (const std::string& reference : {kReference, kLap}) {
    const std::string track =
        "{efforts: {x: {kind: track, joint: x, feed_forward: f, stiffness: 900, damping: 9, " +
        reference + "}}}";
    ExpectRight(Cart(), track, 0.8);
  }
  ExpectRight(Arm(),
              "{efforts: {shoulder: {kind: track, joint: shoulder, feed_forward: f, stiffness: 90, "
              "damping: 2, "
              "reference: {times: [-0.05, 0.1, 0.2, 0.35], values: [0, 1, -1, 0.5]}}, elbow: "
              "{kind: timed_force, link: lower, point: [0, 0, -0.2], force: [1, 0, 0], reference: "
              "{times: [0.03, 0.06, 0.21, 0.3], values: [0, 30, -20, 0]}}}}",
              0.5);
}

const std::string kHills =
    "kind: height_map, origin: [-1, -1], step: [0.3, 2], heights: [[0, 0.1, 0, 0.15, 0, 0.2, 0, "
    "0.1], [0, 0.1, 0, 0.15, 0, 0.2, 0, 0.1]]";
const std::string kStairs = "kind: stairs, rise: 0.03, run: 0.3, riser: 0.25, first: 0.2, last: 2";
const std::string kBox =
    "kind: box, center: [0.7, 0, 0.1], length: 0.8, width: 2, height: 0.1, riser: 0.3, yaw: 0.2";
const std::string kShaker =
    ", motion: {direction: [0.2, 0, 1], times: [-0.1, 0.13, 0.29, 0.6], values: [0, 0.02, -0.01, "
    "0]}";
const std::string kLapOfGround =
    ", motion: {direction: [1, 0, 0.3], times: [0, 0.1, 0.17, 0.3], values: [0, 0.02, -0.01, 0], "
    "periodic: true}";

/// A block that lands and slides on, over several knots.
std::string OnGround(const std::string& ground) {
  return "{constraints: {block: {link: block, " + ground +
         "}}, nominal: {positions: {x: -0.13, z: 0.3}, velocities: {x: 2.3, z: -1}}}";
}

TEST(SplineKnots, OfGroundThatIsSlidOn) {
  for (const std::string& ground : {kHills, kStairs, kBox}) {
    ExpectRight(Block(), OnGround(ground), 0.6, false);
    ExpectRight(Block(), OnGround(ground + ", friction: 0.2"), 0.6, false);
  }
}

TEST(SplineKnots, OfGroundThatMoves) {
  for (const std::string& motion : {kShaker, kLapOfGround}) {
    for (const std::string& ground : {kHills, kStairs}) {
      ExpectRight(Block(), OnGround(ground + motion), 0.57, false);
    }
  }
}

/// A motion in the plane y = 0 along a line of the grid. Parameters may move the ground across it:
/// what jumps there is of second order.
TEST(SplineKnots, OfGroundThatIsSlidOnAlongAKnot) {
  const std::string ground =
      "kind: height_map, origin: [-1, -0.5], step: [0.3, 0.5], heights: [[0, 0.2, 0, 0.1, 0, 0.1, "
      "0.1, 0], [0, 0.1, 0, 0.15, 0, 0.2, 0, 0.1], [0.1, 0, 0.2, 0, 0.1, 0, 0.2, 0]]";
  const struct {
    const char *more, *parameter;
  } cases[] = {
      {", friction: 0.2", "block/friction"},
      {", motion: {direction: [0, 1, 0], velocity: 0}", "block/motion_velocity"},
      {", motion: {direction: [1, 0, 0], velocity: 0.3}", "block/motion_direction_y"},
  };
  for (const auto& [more, parameter] : cases) {
    SCOPED_TRACE(parameter);
    test::ExpectQuotients(Block(),
                          "{constraints: {block: {link: block, " + ground + more +
                              "}}, nominal: {positions: {x: -0.13, z: 0.3}, velocities: {x: 2.3, "
                              "z: -1}}, parameters: {g: gravity, p: " +
                              parameter + "}}",
                          0.3);
  }
}

/// Steps end at the knots, whatever the tolerance; also where a run is cut into commands.
TEST(SplineKnots, EndSteps) {
  const RobotSystem system = Make(
      Cart(), "{efforts: {x: {kind: track, joint: x, feed_forward: f, stiffness: 20, damping: 1, " +
                  kLap + "}}}");
  const auto expect = [](const Arc& arc) {
    for (const double knot : {0.07, 0.15, 0.26, 0.33, 0.41, 0.52}) {
      double nearest = std::numeric_limits<double>::infinity();
      for (std::size_t k = 0; k < arc.dense.NumSteps(); ++k) {
        nearest = std::min(nearest, std::abs(arc.dense.StepBegin(k) - knot));
      }
      EXPECT_LE(nearest, 1e-14) << knot;
    }
  };
  for (const double tolerance : {1e-4, 1e-8, 1e-12}) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    const Trajectory run = Simulate(system, system.nominal().x, system.nominal().u, 0.6, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(1u, run.arcs.size());
    expect(run.arcs[0]);
    const std::vector<double> instants = CornerInstants(system, run.arcs[0]);
    ASSERT_EQ(7u, instants.size());
    EXPECT_NEAR(0.41, instants[4], 1e-14);
  }
}

/// The system under inputs that are led through time has the knots of its base.
TEST(SplineKnots, OfTheBaseOfLinearInputs) {
  const auto base = std::make_shared<RobotSystem>(
      ParseRobot(Block(),
                 YAML::Load("{efforts: {x: {kind: track, joint: x, feed_forward: f, stiffness: 20, "
                            "damping: 1, " +
                            kLap + "}}, " + OnGround(kHills).substr(1))),
      ParameterValues());
  const LinearInputs system(base);
  const Vector x = base->nominal().x, wide = system.State(x, 0.4);
  const CornerFunctions one(*base), other(system);
  EXPECT_NEAR(0.07, one.TimeToKnot(x), 1e-15);
  EXPECT_EQ(one.TimeToKnot(x), other.TimeToKnot(wide));
  ASSERT_EQ(2, one.size());
  EXPECT_EQ(one.corners(0), other.corners(0));
  Vector value, same;
  one.Evaluate(x, base->nominal().u, ContactMode({0}), &value);
  other.Evaluate(wide, Vector::Zero(system.num_inputs()), ContactMode({0}), &same);
  EXPECT_NEAR((-0.13 + 1) / 0.3, value(0), 1e-14);
  EXPECT_EQ(value, same);
  one.Evaluate(x, base->nominal().u, ContactMode(), &value);
  EXPECT_TRUE(std::isnan(value(0)));  // the surface pushes nothing
}

TEST(SplineKnots, OfOneFunction) {
  const TimeFunction once(TimeFunction::Kind::kCubic, {0, 1, 3}, {0, 1, 0}, false);
  EXPECT_EQ(0, once.NextKnot(-5));
  EXPECT_EQ(3, once.NextKnot(1));
  EXPECT_TRUE(std::isinf(once.NextKnot(3)));
  const TimeFunction lap(TimeFunction::Kind::kCubic, {1, 2, 4, 6}, {0, 1, 2, 0}, true);
  EXPECT_EQ(2, lap.NextKnot(1));
  EXPECT_EQ(6, lap.NextKnot(4));
  EXPECT_EQ(7, lap.NextKnot(6));
  EXPECT_EQ(-3, lap.NextKnot(-3.5));
  const TimeFunction line(TimeFunction::Kind::kLinear, {0, 1, 3}, {0, 1, 0}, false);
  EXPECT_TRUE(std::isinf(line.NextKnot(0)));  // its switches are events
  const NaturalSpline spline({0, 1, 3}, {0, 1, 0});
  EXPECT_EQ(1, spline.NextKnot(0));
  EXPECT_TRUE(std::isinf(spline.NextKnot(3)));
}

}  // namespace
}  // namespace contact_flow
