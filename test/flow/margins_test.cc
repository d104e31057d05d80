// SPDX-License-Identifier: BSD-3-Clause
// The smallest gaps and forces that led to no event, wherever in the steps and arcs they lie.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

constexpr double kTenPerSecond = 10;

/// A body of 1 kg and 10 kg m² in the plane, pushed upward by `push`.
std::unique_ptr<RobotSystem> PushedBody(const std::string& constraints,
                                        double gravity = kTenPerSecond,
                                        const std::string& efforts = "") {
  RobotTexts texts;
  texts.urdf =
      "<robot name='body'><link name='body'><inertial><mass value='1'/>"
      "<inertia ixx='10' iyy='10' izz='10' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>";
  texts.yaml =
      "base: planar\ngravity: " + std::to_string(gravity) +
      "\ninputs: [push]\nefforts:\n  lift: {kind: actuator, joint: base_z, input: push}\n" +
      efforts + "constraints:\n" + constraints;
  return MakeRobot(texts);
}

const char kRigidGround[] =
    "  floor: {kind: plane, link: body, point: [0, 0, 0], restitution: 0}\n";

/// (x, z, pitch, rates), with pushes held for equal times.
Trajectory RunOnGrid(const RobotSystem& system, const Vector& x, double duration,
                     const std::vector<double>& pushes) {
  InputSchedule schedule;
  for (std::size_t k = 0; k < pushes.size(); ++k) {
    schedule.grid.push_back(duration * static_cast<double>(k) / static_cast<double>(pushes.size()));
    schedule.values.push_back(Vector::Constant(1, pushes[k]));
  }
  return Simulate(system, x, schedule, duration);
}

Vector AtHeight(double z, double rate) {
  Vector x = Vector::Zero(6);
  x(1) = z;
  x(4) = rate;
  return x;
}

TEST(Margins, AGapIsFoundBetweenTheInstantsOfAnyGrid) {
  const auto system = PushedBody(
      "  ceiling: {kind: plane, link: body, point: [0, 0, 0], normal: [0, 0, -1], offset: -1}\n");
  for (const int intervals : {1, 2, 7, 100, 1000}) {
    const Trajectory run =
        RunOnGrid(*system, AtHeight(0.5, 3), 0.6, std::vector<double>(intervals, 0));
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    EXPECT_NEAR(0.5 - 9 / (2 * kTenPerSecond), run.margins.gap, 1e-9) << intervals << " intervals";
  }
}

TEST(Margins, AForceIsLeastBesideJumpsOfTheInput) {
  const auto system = PushedBody(kRigidGround);
  EXPECT_NEAR(2, RunOnGrid(*system, AtHeight(0, 0), 0.4, {0, 5, 8, 3}).margins.force, 1e-8);
  EXPECT_NEAR(4, RunOnGrid(*system, AtHeight(0, 0), 0.4, {0, 6, 2, 3}).margins.force, 1e-8);
  // Where a run begins or ends is no minimum.
  EXPECT_EQ(Margins::kNone, RunOnGrid(*system, AtHeight(0, 0), 0.4, {8, 5, 2, 0}).margins.force);
  EXPECT_EQ(Margins::kNone, RunOnGrid(*system, AtHeight(0, 0), 0.4, {0, 2, 5, 8}).margins.force);
}

/// λ = 10 − min(8, 20 s) + 5 s along a spline s from 0 to 1: least at a corner within an arc.
TEST(Margins, AForceIsLeastAtACornerWhereStepsMeet) {
  const auto track = [](const std::string& name, const std::string& rest, int end) {
    return "  " + name + ": {kind: track, joint: base_z, feed_forward: push, damping: 0, " + rest +
           ", reference: {times: [0, 1], values: [0, " + std::to_string(end) + "]}}\n";
  };
  const auto system =
      PushedBody(kRigidGround, kTenPerSecond,
                 track("up", "stiffness: 20, limit: 8", 1) + track("down", "stiffness: 5", -1));
  Vector x = Vector::Zero(system->state_size());
  x(system->state_size() - 1) = 1;  // of the clock
  const Trajectory run = Simulate(*system, x, Vector::Zero(1), 0.9);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_NEAR(4, run.margins.force, 1e-6);
}

/// ÿ = 6 s, ṡ = 1, above a floor.
struct Cubic : test::UnitMasses<2, 1> {
  static constexpr const char* kName = "cubic";
  static constexpr std::array<const char*, 2> kCoordinates = {"y", "s"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "s"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>& q,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = 6.0 * q(1);
    (*f)(1) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 2, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(0);
  }
};

/// y = s³ − 3 w² s + c is what one step of any length makes of it, with a maximum at s = −w and its
/// minimum c − 2 w³ at w.
TEST(Margins, AGapIsFoundBehindItsMaximumInTheSameStep) {
  const auto system = test::Make<Cubic>();
  const double w = 0.02, c = 0.05;
  for (double s = -0.3; s < -0.1; s += 0.002) {
    Vector x(4);
    x << s * s * s - 3 * w * w * s + c, s, 3 * (s * s - w * w), 1;
    const Trajectory run = Simulate(system, x, Vector(0), 0.4);
    ASSERT_TRUE(run.transitions.empty());
    EXPECT_NEAR(c - 2 * w * w * w, run.margins.gap, 1e-9) << "from s = " << s;
  }
}

/// A body that comes to rest on its floor stops what it carries 4 cm higher. Whether that is a
/// minimum is known when it goes on: up, pushed with twice its weight, or no more.
TEST(Margins, AGapThatStandsIsLeastIfItRisesLater) {
  const auto system = PushedBody(std::string(kRigidGround) +
                                 "  shelf: {kind: plane, link: body, point: [0, 0, 0.04]}\n");
  EXPECT_NEAR(0.04, RunOnGrid(*system, AtHeight(0.1, 0), 0.6, {0, 0, 20}).margins.gap, 1e-8);
  EXPECT_EQ(Margins::kNone, RunOnGrid(*system, AtHeight(0.1, 0), 0.6, {0, 0, 8}).margins.gap);
}

/// A rod of much inertia falls without gravity, almost level, on an elastic end: the other one is
/// thrown up before it arrives, 2 L sin θ above the ground.
TEST(Margins, AGapIsLeastWhereAnImpactElsewhereTurnsIt) {
  const double angle = 0.01, half = 0.5;
  const auto system = PushedBody(
      "  left: {kind: plane, link: body, point: [-0.5, 0, 0], restitution: 1}\n"
      "  right: {kind: plane, link: body, point: [0.5, 0, 0], restitution: 1}\n",
      0);
  Vector x = AtHeight(0.3, -1);
  x(2) = angle;
  const Trajectory run = Simulate(*system, x, Vector::Zero(1), 0.5);
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_NEAR(2 * half * std::sin(angle), run.margins.gap, 1e-9);
}

}  // namespace
}  // namespace contact_flow
