// SPDX-License-Identifier: BSD-3-Clause
// Orbits of what follows time: its clock runs at its rate, whatever the search makes of the rest.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <memory>
#include <string>

#include "contact_flow/analysis/periodic_orbit.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/piecewise_linear/stability.h"

namespace contact_flow {
namespace {

constexpr double kFallen = 9.81;

std::string SolidLink(const std::string& name) {
  return "<link name=\"" + name +
         "\"><inertial><mass value=\"1\"/><inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" "
         "iyz=\"0\" izz=\"0.1\"/></inertial></link>";
}

/// A mass that slides up and down, its height `z`.
RobotTexts Mass(const std::string& yaml) {
  RobotTexts texts;
  texts.urdf = "<robot name=\"mass\"><link name=\"rail\"/>" + SolidLink("mass") +
               "<joint name=\"z\" type=\"prismatic\"><parent link=\"rail\"/><child "
               "link=\"mass\"/><axis xyz=\"0 0 1\"/><limit lower=\"-9\" upper=\"9\" effort=\"1\" "
               "velocity=\"1\"/></joint></robot>";
  texts.yaml = yaml;
  return texts;
}

OrbitProblem Forced(const RobotTexts& texts, const MechanicalSystem& system, double period) {
  OrbitProblem problem;
  problem.factory = [texts](const ParameterValues&) { return MakeRobot(texts); };
  problem.section.symmetry.Shift(system, "clock", -period);
  problem.u = Vector::Zero(system.num_inputs());
  return problem;
}

double SpectralRadius(const PiecewiseLinearMap& map) {
  return Eigen::EigenSolver<Matrix>(map.pieces().front().matrix)
      .eigenvalues()
      .cwiseAbs()
      .maxCoeff();
}

/// A ball on a plate A sin ω t, hit once in each of its periods T: up again at v = g T/2, where the
/// plate rises at w = v (1 − e)/(1 + e) = A ω cos φ. A return shrinks areas by e², and both
/// eigenvalues lie on one circle.
TEST(ClockedOrbit, ABallBouncesInTimeWithItsPlate) {
  const double period = 0.5, e = 0.8, omega = 2 * M_PI / period, A = 0.03;
  const RobotTexts texts = Mass(
      "{base: fixed, constraints: {floor: {kind: plane, link: mass, restitution: 0.8, motion: "
      "{direction: [0, 0, 1], amplitude: 0.03, frequency: 2, phase: 0}}}}");
  const auto system = MakeRobot(texts);
  const double v = kFallen * period / 2;
  const double phase = std::acos(v * (1 - e) / (1 + e) / (A * omega));
  for (const bool at_plate : {true, false}) {
    SCOPED_TRACE(at_plate ? "at the plate" : "at the apex");
    OrbitProblem problem = Forced(texts, *system, period);
    const ReturnSymmetry symmetry = problem.section.symmetry;
    problem.section = at_plate ? Section::Event(*system, "floor") : Section::Apex(*system, "z");
    problem.section.symmetry = symmetry;
    Vector orbit(4);
    orbit << A * std::sin(phase), phase / omega, v, 1;
    if (!at_plate)
      orbit << A * std::sin(phase) + v * v / (2 * kFallen), phase / omega + v / kFallen, 0, 1;
    problem.x = orbit;
    problem.x(1) += 0.01;
    if (at_plate) {
      problem.x(0) = A * std::sin(omega * problem.x(1));
      problem.x(2) += 0.01;
    } else {
      problem.x(0) += 0.003;
    }
    const OrbitSolution found = FindOrbit(problem);
    ASSERT_TRUE(found.ok()) << found.newton.message;
    EXPECT_EQ(1, found.x(3));
    EXPECT_NEAR(period, found.orbit.time, 1e-9);
    EXPECT_LE((found.x - orbit).cwiseAbs().maxCoeff(), 1e-8) << found.x.transpose();
    ASSERT_EQ(2, found.orbit.reduced.rows());
    EXPECT_NEAR(e, SpectralRadius(found.orbit.reduced), 1e-8);
    EXPECT_EQ(StabilityVerdict::kStable, AssessStability(found.orbit.reduced).verdict);
  }
}

/// A mass on a servo that follows a spline of period 0.8 s: a return is a period of the servo's own
/// decay, e^(−c T/(2 m)).
TEST(ClockedOrbit, AServoFollowsItsReference) {
  const double period = 0.8;
  const RobotTexts texts = Mass(
      "{base: fixed, gravity: 0, efforts: {servo: {kind: track, joint: z, feed_forward: f, "
      "stiffness: 30, damping: 2, reference: {kind: cubic, times: [0, 0.2, 0.5, 0.8], values: [0, "
      "0.3, -0.1, 0], periodic: true}}}}");
  const auto system = MakeRobot(texts);
  OrbitProblem problem = Forced(texts, *system, period);
  const ReturnSymmetry symmetry = problem.section.symmetry;
  problem.section = Section::Apex(*system, "z");
  problem.section.symmetry = symmetry;
  SimulateOptions tight;
  tight.relative_tolerance = tight.absolute_tolerance = 1e-12;
  Vector x(4);
  x << 0, 0, 0, 1;
  const Vector settled = Simulate(*system, x, problem.u, 40 * period, tight).FinalState();
  x << settled(0), 0, settled(2), 1;
  PoincareOptions options;
  const Vector apex =
      PoincareMap(*system, problem.u, Section::Apex(*system, "z"), options).Return(x, false).x;
  problem.x = apex;
  problem.x(0) *= 1.2;
  problem.x(1) += 0.03;
  const OrbitSolution found = FindOrbit(problem);
  ASSERT_TRUE(found.ok()) << found.newton.message;
  EXPECT_EQ(1, found.x(3));
  EXPECT_NEAR(period, found.orbit.time, 1e-9);
  EXPECT_LE((found.x - apex).cwiseAbs().maxCoeff(), 1e-6) << found.x.transpose();
  EXPECT_NEAR(std::exp(-period), SpectralRadius(found.orbit.reduced), 1e-8);
}

/// A block stands on a plate that shakes along it and swings a pendulum: what sticks at the section
/// is moved with the plate, not the plate's clock with what sticks.
TEST(ClockedOrbit, WhatSticksOnAShakenPlateKeepsItsClock) {
  const double period = 0.5;
  RobotTexts texts;
  texts.urdf =
      "<robot name=\"block\">" + SolidLink("block") +
      "<link name=\"bob\"><inertial><origin xyz=\"0 0 -0.3\"/><mass value=\"0.1\"/><inertia "
      "ixx=\"0.001\" ixy=\"0\" ixz=\"0\" iyy=\"0.001\" iyz=\"0\" izz=\"0.001\"/></inertial>"
      "</link><joint name=\"swing\" type=\"continuous\"><parent link=\"block\"/><child "
      "link=\"bob\"/><axis xyz=\"0 1 0\"/></joint></robot>";
  const std::string motion =
      ", friction: 2, motion: {direction: [1, 0, 0], amplitude: 0.01, frequency: 2, phase: 0}}";
  texts.yaml = "{base: planar, constraints: {a: {kind: plane, link: block, point: [-1, 0, -1]" +
               motion + ", b: {kind: plane, link: block, point: [1, 0, -1]" + motion +
               "}, efforts: {s: {kind: joint_spring, joint: swing, stiffness: 0, damping: 0.03}}}";
  const auto system = MakeRobot(texts);
  OrbitProblem problem = Forced(texts, *system, period);
  const ReturnSymmetry symmetry = problem.section.symmetry;
  problem.section = Section::Apex(*system, "swing");
  problem.section.symmetry = symmetry;
  const int clock = 4, d = 5;
  const auto standing = [&](double angle, double rate, double t) {
    Vector x = Vector::Zero(2 * d);
    x(0) = 0.01 * std::sin(4 * M_PI * t);
    x(1) = 1;
    x(3) = angle;
    x(clock) = t;
    x(d) = 0.04 * M_PI * std::cos(4 * M_PI * t);
    x(d + 3) = rate;
    x(d + clock) = 1;
    return x;
  };
  const PoincareMap map(*system, problem.u, Section::Apex(*system, "swing"), {});
  Vector x = standing(0, 0, 0);
  for (int k = 0; k < 25; ++k) x = map.Return(x, false).x;
  const double t = std::fmod(x(clock), period);
  problem.x = standing(x(3) * 1.2, 0, t + 0.03);
  const OrbitSolution found = FindOrbit(problem);
  ASSERT_TRUE(found.ok()) << found.newton.message;
  EXPECT_EQ("ss", found.orbit.trajectory.arcs.front().mode.Word(2));
  EXPECT_EQ(1, found.x(d + clock));
  EXPECT_NEAR(period, found.orbit.time, 1e-9);
  EXPECT_NEAR(x(3), found.x(3), 1e-5);
}

}  // namespace
}  // namespace contact_flow
