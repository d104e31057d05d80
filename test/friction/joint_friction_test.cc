// SPDX-License-Identifier: BSD-3-Clause
// Coulomb friction of joints: a rotor beside its closed form, a double pendulum beside quotients.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/friction/robot_twins.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::AtTolerance;
using test::Entries;
using test::Link;
using test::Robot;
using test::Slide;

constexpr char kRotor[] =
    "<robot name='rotor'><link name='base'/>"
    "<link name='wheel'><inertial><mass value='1'/><inertia ixx='0.2' ixy='0' ixz='0' iyy='0.2' "
    "iyz='0' izz='0.2'/></inertial></link><joint name='hub' type='continuous'>"
    "<parent link='base'/><child link='wheel'/><axis xyz='0 1 0'/><dynamics friction='2'/>"
    "</joint></robot>";
constexpr double kWheelInertia = 0.2, kHubFriction = 2;

constexpr char kRotorYaml[] =
    "joints: {friction: all}\n"
    "efforts: {motor: {kind: actuator, joint: hub, input: torque}}\n"
    "parameters: {friction: hub_friction/friction}\n";

/// q̈ = (u ∓ τ)/I: it stops at t = I ω/(τ − u), having turned by ω t/2, and stays.
TEST(JointFriction, RotorStopsAndStays) {
  const auto robot = Robot(kRotor, kRotorYaml);
  ASSERT_EQ(2, robot->dof());  // hub, hub_pad
  const double speed = 5, u = 0.5, stop = kWheelInertia * speed / (kHubFriction - u);
  const Vector x = Entries({0.3, 0, speed, 0});
  const Trajectory run = Simulate(*robot, x, Entries({u}), 2, AtTolerance(1e-11));
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("+", run.arcs[0].mode.Word(1));
  EXPECT_EQ("s", run.arcs[1].mode.Word(1));
  EXPECT_NEAR(stop, run.transitions[0].t, 1e-10);
  EXPECT_NEAR(0.3 + speed * stop / 2, run.FinalState()(0), 1e-10);
  EXPECT_TRUE(run.FinalState().tail(3).isZero(1e-12)) << "the pad has not moved";
  BDerivativeOptions options;
  options.variables.inputs = true;
  options.variables.parameters = ParameterIndices(robot->description(), {"friction"});
  const BDerivative B = DifferentiateOutcome(*robot, run, options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const auto by = [&](int j) { return B(Vector::Unit(6, j))(0); };
  EXPECT_NEAR(1, by(0), 1e-8);
  EXPECT_NEAR(stop, by(2), 1e-8) << "d/dω of I ω²/(2 (τ − u))";
  EXPECT_NEAR(speed * stop / 2 / (kHubFriction - u), by(4), 1e-8) << "by u";
  EXPECT_NEAR(-speed * stop / 2 / (kHubFriction - u), by(5), 1e-8) << "by τ";
}

/// A wheel held by its hub, under a torque that grows until it breaks away, in any unit of mass. A
/// cone of 1e-9 N m was taken for zero: light ones stuck for longer.
TEST(JointFriction, DoesNotDependOnTheUnitOfMass) {
  std::vector<double> instants;
  Vector end;
  for (const double unit : {1.0, 0x1p-30, 0x1p30}) {
    std::ostringstream urdf, yaml;
    urdf.precision(17);
    yaml.precision(17);
    urdf << "<robot name='r'><link name='base'/><link name='wheel'><inertial><mass value='" << unit
         << "'/><inertia ixx='0' ixy='0' ixz='0' iyy='" << 0.2 * unit
         << "' iyz='0' izz='0'/></inertial></link><joint name='hub' type='continuous'>"
         << "<parent link='base'/><child link='wheel'/><axis xyz='0 1 0'/><dynamics friction='"
         << 2 * unit << "'/></joint></robot>";
    yaml << "joints: {friction: all}\n"
         << "efforts: {motor: {kind: track, joint: hub, feed_forward: torque, stiffness: "
         << 50 * unit << ", damping: " << unit << ", reference: {kind: cubic, "
         << "times: [0, 0.3, 0.6, 0.9, 1.2], values: [0, 0.0399, 0.0401, 0.2, -0.3]}}}\n";
    const auto robot = Robot(urdf.str(), yaml.str());
    const Trajectory run = Simulate(*robot, robot->nominal().x, robot->nominal().u, 1.2);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    if (end.size() == 0) {
      for (const Transition& transition : run.transitions) instants.push_back(transition.t);
      ASSERT_GE(instants.size(), 3u);
      end = run.FinalState();
      continue;
    }
    ASSERT_EQ(instants.size(), run.transitions.size()) << unit;
    for (std::size_t k = 0; k < instants.size(); ++k) {
      EXPECT_NEAR(instants[k], run.transitions[k].t, 1e-10) << unit << ' ' << k;
    }
    EXPECT_LE((run.FinalState() - end).cwiseAbs().maxCoeff(), 1e-10) << unit;
  }
}

/// At rest it holds up to τ, and beyond turns with what is left.
TEST(JointFriction, RotorHoldsAndBreaksAway) {
  const auto robot = Robot(kRotor, kRotorYaml);
  const Vector rest = Vector::Zero(4);
  for (double u : {-1.9, 1.9}) {
    const Trajectory held = Simulate(*robot, rest, Entries({u}), 1, AtTolerance(1e-11));
    ASSERT_TRUE(held.status.ok()) << held.status.message;
    EXPECT_TRUE(held.FinalState().isZero(1e-12)) << u;
  }
  for (double u : {-3., 3.}) {
    const Trajectory turned = Simulate(*robot, rest, Entries({u}), 0.5, AtTolerance(1e-11));
    ASSERT_TRUE(turned.status.ok()) << turned.status.message;
    EXPECT_NEAR(std::copysign(0.5 * (3 - kHubFriction) / kWheelInertia * 0.25, u),
                turned.FinalState()(0), 1e-9);
  }
}

constexpr char kArm[] =
    "<robot name='arm'><link name='base'/><link name='upper'><inertial><origin xyz='0 0 -0.3'/>"
    "<mass value='2'/><inertia ixx='0.02' ixy='0' ixz='0' iyy='0.02' iyz='0' izz='0.001'/>"
    "</inertial></link><link name='fore'><inertial><origin xyz='0 0 -0.2'/><mass value='1'/>"
    "<inertia ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='0.001'/></inertial></link>"
    "<joint name='shoulder' type='continuous'><parent link='base'/><child link='upper'/>"
    "<axis xyz='0 1 0'/><dynamics friction='1'/></joint>"
    "<joint name='elbow' type='continuous'><parent link='upper'/><child link='fore'/>"
    "<origin xyz='0 0 -0.5'/><axis xyz='0 1 0'/><dynamics friction='0.5'/></joint></robot>";

const std::string kSmoothArm =
    "constraints: {floor: {kind: plane, link: fore, point: [0, 0, -0.4], offset: -0.85}}\n"
    "nominal: {positions: {shoulder: 1, elbow: 0.3}, velocities: {shoulder: -1, elbow: 2}}\n";
const std::string kArmYaml =
    kSmoothArm +
    "parameters: {upper: shoulder_friction/friction, lower: elbow_friction/friction}\n"
    "joints: {friction: all}\n";

/// Joints stop and go, and the hand hits the floor: B beside one-sided quotients, by the state of
/// the joints and by both frictions.
TEST(JointFriction, ArmHitsTheFloor) {
  const auto robot = Robot(kArm, kArmYaml);
  const Vector x = robot->nominal().x, u;
  const Trajectory run = Simulate(*robot, x, u, 0.6, AtTolerance(1e-11));
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_GT(run.transitions.size(), 5u);
  BDerivativeOptions options;
  options.variables.parameters = ParameterIndices(robot->description(), {"upper", "lower"});
  const BDerivative B = DifferentiateOutcome(*robot, run, options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const SystemFactory again = [](const ParameterValues& values) {
    RobotTexts texts;
    texts.urdf = kArm;
    texts.yaml = kArmYaml;
    return MakeRobot(texts, values);
  };
  for (int j : {0, 1, 4, 5, 8, 9}) {  // shoulder, elbow, their rates, their frictions
    for (double sign : {1., -1.}) {
      const Vector w = sign * Vector::Unit(10, j);
      const QuotientReport report =
          CompareWithQuotients(*robot, again, options.variables, x, {{0}, {u}}, 0.6, w, B(w),
                               {1e-4, 1e-5}, AtTolerance(1e-11));
      // Errors are of first order in α; of the runs' own 1e-11/α are left.
      EXPECT_LT(report.samples[1].error, 0.12 * report.samples[0].error + 5e-6) << j << sign;
      EXPECT_LT(report.samples[1].error, 1e-2) << j << sign;
    }
  }
}

/// A torque that is finite has no impulse: the hand's impact is that of the arm without friction,
/// from 1e-6 s before it, in which speeds change by some 1e-5.
TEST(JointFriction, ImpactsDoNotFeelIt) {
  const auto robot = Robot(kArm, kArmYaml), smooth = Robot(kArm, kSmoothArm);
  SimulateOptions options = AtTolerance(1e-11);
  const Trajectory run = Simulate(*robot, robot->nominal().x, Vector(), 0.6, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  int impacts = 0;
  for (const Transition& event : run.transitions) {
    if (!event.activated.Contains(0)) continue;
    ++impacts;
    const Vector x = run.State(event.t - 1e-6);
    Vector before(4);
    before << x.head(2), x.segment(4, 2);
    options.max_events = 1;
    const Trajectory hit = Simulate(*smooth, before, Vector(), 1e-5, options);
    ASSERT_FALSE(hit.transitions.empty()) << hit.status.message;
    EXPECT_TRUE(hit.transitions[0].x_plus.tail(2).isApprox(event.x_plus.segment(4, 2), 1e-4))
        << event.t << ": " << hit.transitions[0].x_plus.transpose() << " for "
        << event.x_plus.transpose();
  }
  EXPECT_GT(impacts, 0);
}

/// Pads are by name what a joint's friction is asked by.
TEST(JointFriction, RefusesJointsWithout) {
  std::string urdf = kRotor;
  urdf.replace(urdf.find("<dynamics friction='2'/>"), 24, "");
  try {
    Robot(urdf, "joints: {friction: [hub]}");
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string::npos,
              std::string(error.what()).find("the URDF gives joint 'hub' no friction (line 1)"))
        << error.what();
  }
}

/// The pad's row is that of the stop: an impact that it has no part in.
TEST(JointFriction, HasADerivativeAtItsOwnStop) {
  const std::string urdf =
      "<robot name='slide'>" + Link("ground", 0, 0, 0, 0) + Link("A", 1, 1, 1, 1) +
      "<joint name='j' type='prismatic'><parent link='ground'/><child link='A'/>"
      "<axis xyz='1 0 0'/><limit lower='-9' upper='0.1' effort='9' velocity='9'/>"
      "<dynamics friction='1'/></joint></robot>";
  for (const double restitution : {0., 0.3}) {
    std::ostringstream yaml;
    yaml << "base: fixed\njoints: {limits: [j], friction: [j], restitution: " << restitution
         << "}\nefforts: {push: {kind: actuator, joint: j, input: u}}\n";
    const auto robot = Robot(urdf, yaml.str());
    const auto from = [&](double speed) {
      return Simulate(*robot, Entries({0, 0, speed, 0}), Entries({5}), 0.15, AtTolerance(1e-12));
    };
    const Trajectory run = from(1);
    const BDerivative B = DifferentiateOutcome(*robot, run);
    ASSERT_TRUE(B.status.ok()) << restitution << ": " << B.status.message;
    const Vector quotient = (from(1 + 1e-6).FinalState() - run.FinalState()) / 1e-6;
    EXPECT_TRUE((B(Vector::Unit(4, 2)) - quotient).isZero(1e-5)) << quotient.transpose();
  }
}

/// A falls along a rail, B hangs on it by a slide that a spring presses on its stop. All forces are
/// vertical, so that the floor's friction matters nothing, and the slide's is against its motion.
TEST(JointFriction, AnImpactElsewhereLiftsAJointOffItsStop) {
  const std::string urdf = "<robot name='hung'>" + Link("ground", 0, 0, 0, 0) +
                           Link("cart", 0, 0, 0, 0) + Link("A", 1, 1, 1, 1) +
                           Link("B", 1, 1, 1, 1) + Slide("x", "ground", "cart", "1 0 0") +
                           Slide("z", "cart", "A", "0 0 1") +
                           "<joint name='j' type='prismatic'><parent link='A'/><child link='B'/>"
                           "<axis xyz='0 0 1'/><limit lower='-1' upper='0' effort='1' "
                           "velocity='1'/><dynamics friction='3'/></joint></robot>";
  std::vector<Vector> ends;
  for (const char* friction : {"", ", friction: 0.3"}) {
    const auto robot =
        Robot(urdf, std::string("constraints: {floor: {kind: plane, link: A, restitution: 0.5") +
                        friction +
                        "}}\njoints: {limits: [j], friction: [j]}\nefforts: {press: {kind: "
                        "joint_spring, joint: j, stiffness: 1, rest: 6}}\nbase: fixed\n");
    const Vector x = Entries({0, 0.2, 0, 0, 0, 0, 0, 0});  // x, z, j, j_pad
    const Trajectory run = Simulate(*robot, x, Vector(), 0.3, AtTolerance(1e-11));
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(2u, run.arcs.size()) << friction;
    ends.push_back(run.FinalState());
  }
  EXPECT_NEAR(-1.183179, ends[0](6), 1e-6);
  EXPECT_TRUE(ends[0].isApprox(ends[1], 1e-9)) << ends[1].transpose();
}

}  // namespace
}  // namespace contact_flow
