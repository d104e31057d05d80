// SPDX-License-Identifier: BSD-3-Clause
// Limits of the radius of validity between the instants that are looked at, against closed forms:
// dips in long steps, in small units, a speed that a slope changes, returns inside a cluster.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <sstream>
#include <string>

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/model/model_system.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::AtTolerance;
using test::Entries;

using Limit = ValidityRadius::Limit;

ValidityRadius RadiusOf(const MechanicalSystem& system, const Trajectory& run, const Vector& w,
                        const Variables& variables = {}) {
  EXPECT_TRUE(run.status.ok()) << run.status.message;
  BDerivativeOptions options;
  options.variables = variables;
  const BDerivative B = DifferentiateOutcome(system, run, options);
  EXPECT_TRUE(B.status.ok()) << B.status.message;
  return ValidityEstimator(system, run, B)(w);
}

/// A body in the plane, whose origin touches a height field of this shape.
std::unique_ptr<RobotSystem> Over(const std::string& shape, const std::string& gravity,
                                  const std::string& more = "") {
  RobotTexts texts;
  texts.urdf =
      "<robot name='p'><link name='b'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' "
      "iyy='1' iyz='0' izz='1'/></inertial></link></robot>";
  texts.yaml = "base: planar\ngravity: " + gravity +
               "\nconstraints: {toe: {kind: height_field, link: b, " + shape + "}}\n" + more;
  return MakeRobot(texts);
}

/// A flight of three steps over waves of which each step passes many: the least gap is 1e-5.
TEST(MissedLimits, DipsInLongSteps) {
  constexpr double kSpeed = 3, kRise = 0.2, kHeight = 0.02, kTime = 0.9, kLeast = 1e-5;
  for (const double waves : {12., 20., 30., 60., 110.}) {
    double least = 1;
    for (int n = 0; n <= 900000; ++n) {
      const double t = kTime * n / 900000;
      least = std::min(least, kRise * t - t * t / 2 - kHeight * std::sin(waves * kSpeed * t));
    }
    std::ostringstream shape;
    shape << "amplitude: " << kHeight << ", wave_x: " << waves;
    for (const char* friction : {"", ", friction: 0.5"}) {
      const auto robot = Over(shape.str() + friction, "1");
      const Vector x = Entries({0, kLeast - least, 0, kSpeed, kRise, 0});
      const Trajectory run = Simulate(*robot, x, Vector(), kTime);
      const ValidityRadius found = RadiusOf(*robot, run, -Vector::Unit(6, 1));
      EXPECT_NEAR(kLeast, found.radius, 1e-3 * kLeast) << waves << friction;
    }
  }
}

/// Gravity turns a body about 1e-4 m below the floor. A slope about the place of its touchdown
/// changes the approach speed alone, v_n + v_x slope.
TEST(MissedLimits, ASlopeEndsATouchdown) {
  constexpr double kAcross = 10, kDeep = 1e-4;
  const double normal = std::sqrt(2 * kDeep), time = 1 - normal;
  for (const char* friction : {"", ", friction: 0.5"}) {
    const auto robot =
        Over(std::string("slope_x: 0") + friction, "-1", "parameters: {slope: toe/slope_x}\n");
    const Vector x = Entries({-kAcross * time, 0.5 - kDeep, 0, kAcross, -1, 0});
    const Trajectory run = Simulate(*robot, x, Vector(), 1.5, AtTolerance(1e-12));
    ASSERT_EQ(1u, run.transitions.size());
    Variables variables;
    variables.parameters = ParameterIndices(robot->description(), {"slope"});
    const ValidityRadius found = RadiusOf(*robot, run, -Vector::Unit(7, 6), variables);
    // Where the speed is 0; it goes there like a root, so that the estimate is half of it.
    EXPECT_EQ(Limit::kApproachSpeed, found.limit) << Describe(robot->description(), found);
    EXPECT_NEAR(normal / kAcross / 2, found.radius, 1e-4 * normal) << friction;
  }
}

/// A point on a spring that sinks from 1e-3 L and rises again, lengths in units of L.
struct Dip : test::UnitMasses<1, 1> {
  static constexpr const char* kName = "dip";
  static constexpr std::array<const char*, 1> kCoordinates = {"z"};
  static constexpr std::array<const char*, 1> kUnits = {"m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  template <class P>
  struct Parameters {
    P unit = 1;
    template <class V>
    void Visit(V&& visit) {
      visit(unit, "unit", "m", "of lengths", Range::kPositive);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 1, 1>& q,
                    const Eigen::Matrix<S, 1, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 1, 1>* f) {
    (*f)(0) = p.unit - q(0);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 1, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    *a = q;
  }
};

/// By δz the least gap, 1 − √(0.999² + 0.01²), changes by 0.999/√(…) of it.
TEST(MissedLimits, DipsInAnyUnit) {
  const double amplitude = std::hypot(0.999, 0.01);
  for (const double unit : {1., 1e3, 1e-3, 1e-6}) {
    const ModelSystem<Dip> system({{"unit", unit}});
    SimulateOptions options;
    options.absolute_tolerance *= unit;
    options.gap_tolerance *= unit;
    options.speed_tolerance *= unit;
    const Trajectory run =
        Simulate(system, Entries({1e-3 * unit, -0.01 * unit}), Vector(), 3, options);
    const ValidityRadius found = RadiusOf(system, run, -Vector::Unit(2, 0));
    EXPECT_NEAR((1 - amplitude) * amplitude / 0.999, found.radius / unit, 1e-6) << unit;
  }
}

/// The input changes as a ball lands, from down to up: lower by α, it is back after 2 r v/(g + u)
/// and bounces again before the change.
TEST(MissedLimits, ABallIsBackBeforeTheInputChanges) {
  for (const double restitution : {0.05, 0.005}) {
    const auto ball = MakeModel("driven_ball", {{"restitution", restitution}});
    const Vector x = Entries({0.2, -1}), down = Entries({-40}), up = Entries({30});
    const double t = Simulate(*ball, x, down, 0.5, AtTolerance(1e-12)).transitions.front().t;
    const Trajectory run =
        Simulate(*ball, x, InputSchedule{{0, t}, {down, up}}, 0.5, AtTolerance(1e-12));
    const double v = -run.transitions.front().x_minus(1);
    const double pull = -ContactDynamics(*ball, down).Field(x, ContactMode())(1);
    const ValidityRadius found = RadiusOf(*ball, run, Entries({-1, 0}));
    EXPECT_EQ(Limit::kGap, found.limit);
    EXPECT_NEAR(2 * restitution * v * v / pull, found.radius, 1e-6) << restitution;
  }
}

}  // namespace
}  // namespace contact_flow
