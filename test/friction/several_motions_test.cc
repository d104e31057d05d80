// SPDX-License-Identifier: BSD-3-Clause
// Bodies on more feet than they have freedom: motions that all fit are told, impacts are those of
// the laws to rounding, and words do not depend on units.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/robot_twins.h"
#include "test/refusal.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::AtTolerance;
using test::Link;
using test::Robot;

/// A light box whose heavy slider is pulled by a spring, down and to the side.
std::string BoxWithSlider() {
  return "<robot name='box'>" + Link("box", 0.194, 0.00265, 0.00265, 0.00265) +
         Link("slider", 7.894, 0.0789, 0.0789, 0.0789) +
         "<joint name='j' type='prismatic'><parent link='box'/><child link='slider'/>"
         "<origin xyz='0.0655 0 0'/><axis xyz='0.98827 0 -0.15275'/>"
         "<limit lower='-9' upper='9' effort='1e9' velocity='1e9'/></joint></robot>";
}

std::string OnFeet(const std::string& base, double j, const std::string& feet) {
  return "base: " + base +
         "\nefforts: {spring: {kind: joint_spring, joint: j, stiffness: 238.6, rest: -0.03936}}\n"
         "nominal: {positions: {base_z: 0.2876, j: " +
         std::to_string(j) + "}, velocities: {j: -1.7}}\nconstraints:\n" + feet;
}

std::string FootAt(int k, double x, double y, const std::string& friction) {
  std::ostringstream foot;
  foot << "  f" << k << ": {kind: plane, link: box, point: [" << x << ", " << y
       << ", -0.2876], friction: " << friction << "}\n";
  return foot.str();
}

std::string RefusedStart(const MechanicalSystem& robot) {
  return test::RefusalOf([&] { Simulate(robot, robot.nominal().x, Vector(), 0.01); });
}

/// Both feet stick, strictly inside their cones, or both rise: as a start that is refused, as it is
/// where one foot has no friction and rows are independent.
TEST(SeveralMotions, OfDependentFeetAreRefusedAsAStart) {
  const std::string pairs[][2] = {{"1", "0"}, {"1", "0.75"}};
  for (const auto& friction : pairs) {
    const std::string feet = FootAt(0, -0.2, 0, friction[0]) + FootAt(1, 0.2, 0, friction[1]);
    const auto robot = Robot(BoxWithSlider(), OnFeet("planar", -0.119, feet));
    const std::string told = RefusedStart(*robot);
    EXPECT_NE(std::string::npos, told.find("several motions fit")) << told;
    EXPECT_NE(std::string::npos, told.find("'oo'")) << told;
  }
}

/// The same in space, and with more feet than words are tried of.
TEST(SeveralMotions, OfFeetInSpaceAreRefusedAsAStart) {
  for (const std::string& friction : {"1", "no_slip"}) {
    for (const int count : {3, 4, 6}) {
      std::string feet = FootAt(0, -0.2, -0.1, friction) + FootAt(1, -0.2, 0.1, friction);
      if (count == 3) feet += FootAt(2, 0.2, 0, friction);
      if (count > 3) feet += FootAt(2, 0.2, -0.1, friction) + FootAt(3, 0.2, 0.1, friction);
      if (count > 4) feet += FootAt(4, 0, 0.1, friction) + FootAt(5, 0, -0.1, friction);
      const auto robot = Robot(BoxWithSlider(), OnFeet("floating", -0.11, feet));
      const std::string told = RefusedStart(*robot);
      const std::string letters(static_cast<std::size_t>(count), 's');
      EXPECT_NE(std::string::npos, told.find("several motions fit")) << count << told;
      EXPECT_NE(std::string::npos, told.find("'" + letters + "'")) << count << told;
    }
  }
}

/// Along a run the motion goes on in which forces are continuous: that of both feet, where one
/// lets go, is that of the other, though both could rise at once. It is told, without derivative.
TEST(SeveralMotions, ARunKeepsTheOneItWasIn) {
  const std::string feet = FootAt(0, -0.2, 0, "1") + FootAt(1, 0.2, 0, "0.75");
  const auto robot = Robot(BoxWithSlider(), OnFeet("planar", -0.06, feet));
  const Vector x = robot->nominal().x;
  const Trajectory run = Simulate(*robot, x, Vector(), 0.05, AtTolerance(1e-11));
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ("ss", run.arcs[0].mode.Word(2));
  EXPECT_EQ("so", run.arcs[1].mode.Word(2));
  ContactDynamics dynamics(*robot, Vector());
  const Transition& event = run.transitions[0];
  dynamics.Evaluate(event.x_minus, event.mode_before);
  const double before = dynamics.force()(0);
  dynamics.Evaluate(event.x_plus, event.mode_after);
  EXPECT_NEAR(before, dynamics.force()(0), 1e-6 * before);
  bool told = false;
  for (const auto& warning : run.warnings) {
    told = told || warning.code == Outcome::kPainleveIndeterminate;
  }
  EXPECT_TRUE(told);
  EXPECT_EQ(Outcome::kPainleveIndeterminate, DifferentiateOutcome(*robot, run).status.outcome);
}

/// Feet that graze are let go, as they were until now, though they could be pressed as well. Where
/// they touch again in no time, that motion does not go on, and one of those follows: such a run
/// ended as CHATTER.
TEST(SeveralMotions, AnotherOneFollowsTheOneThatEndsAtOnce) {
  const std::string feet = FootAt(0, -0.2, 0, "1") + FootAt(1, 0.2, 0, "0.75");
  const auto robot = Robot(BoxWithSlider(), OnFeet("planar", -0.119, feet));
  ContactDynamics dynamics(*robot, Vector());
  const Vector x = robot->nominal().x;
  TouchingContacts touching;
  touching.still = ConstraintSet({0, 1});
  WordConventions by;
  const ContactMode kept = SelectWord(&dynamics, x, touching, 1e-9, &by);
  ASSERT_TRUE(by.smallest);
  ASSERT_EQ("oo", kept.Word(2));
  touching.ended = true;
  const ContactMode other = SelectWord(&dynamics, x, touching, 1e-9, &by);
  EXPECT_FALSE(other.Empty());
  dynamics.Evaluate(x, other);
  EXPECT_GT(dynamics.force().head(2).sum(), 0.1);  // [N]
  // Alone it stays.
  const Vector pulled = robot->Perturb(x, 0.119 * Vector::Unit(2 * robot->dof(), 3));
  touching.ended = false;
  const ContactMode only = SelectWord(&dynamics, pulled, touching, 1e-9, &by);
  touching.before = only;
  touching.ended = true;
  EXPECT_EQ(only, SelectWord(&dynamics, pulled, touching, 1e-9, &by));
}

/// A rod of two links that a spring holds together touches down faster and faster, each time let
/// go by its slip, until it is let go with no speed, and touches in no time. It is pressed then.
TEST(SeveralMotions, ARodThatChattersIsPressed) {
  const auto robot =
      Robot("<robot name='rod'>" + Link("upper", 1, 0.1, 0.0816, 0.1) +
                Link("lower", 0.3, 0.005, 0.005, 0.005) +
                "<joint name='j' type='revolute'><parent link='upper'/><child link='lower'/>"
                "<origin xyz='0 0 -0.3'/><axis xyz='0 1 0'/>"
                "<limit lower='-3' upper='3' effort='1' velocity='1'/></joint></robot>",
            "base: planar\nconstraints: {tip: {kind: plane, link: lower, point: [0, 0, -0.2], "
            "friction: 2.17}}\nefforts: {s: {kind: joint_spring, joint: j, stiffness: 95.3}}\n"
            "nominal: {positions: {base_z: 0.5117, base_pitch: 0.21, j: -0.08}, velocities: "
            "{base_x: -1.48, base_z: -0.95, base_pitch: -2.16, j: 5.13}}\n");
  const Trajectory run = Simulate(*robot, robot->nominal().x, Vector(), 0.3);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  int pressed = 0;
  for (std::size_t k = 1; k < run.transitions.size(); ++k) {
    const Transition &before = run.transitions[k - 1], &event = run.transitions[k];
    if (event.t > before.t || before.grazed.Empty() || event.grazed.Empty()) continue;
    pressed += event.mode_before.Empty() && !event.mode_after.Empty();
  }
  EXPECT_EQ(1, pressed);
}

/// A box that falls exactly flat on points of unequal friction: by Newton's law each leaves with
/// −γ of its speed, so it does not turn, and all land again together. Springs of a stiffness that
/// is finite left 1e-11 rad/s, and one point landed first.
TEST(SeveralMotions, AFlatBoxLandsFlatAgain) {
  const std::vector<std::vector<double>> frictions = {{0.3, 0.5, 0.8}, {0.2, 0.3, 0.5, 0.8}};
  for (const std::vector<double>& friction : frictions) {
    std::ostringstream yaml;
    yaml << "base: planar\nnominal: {positions: {base_z: 0.3}, velocities: {base_x: -1.6}}\n"
         << "constraints:\n";
    for (std::size_t k = 0; k < friction.size(); ++k) {
      const double last = static_cast<double>(friction.size() - 1);
      yaml << "  f" << k << ": {kind: plane, link: box, restitution: 0.6, friction: " << friction[k]
           << ", point: [" << -0.15 + 0.3 * static_cast<double>(k) / last << ", 0, -0.2]}\n";
    }
    const auto robot =
        Robot("<robot name='flat'>" + Link("box", 2, 0.05, 0.05, 0.05) + "</robot>", yaml.str());
    const Trajectory run = Simulate(*robot, robot->nominal().x, Vector(), 0.33);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(2u, run.transitions.size());
    for (const Transition& event : run.transitions) {
      EXPECT_EQ(static_cast<int>(friction.size()), event.activated.Size());
      EXPECT_NEAR(0, event.x_plus(5), 1e-13);
    }
  }
}

/// A box on two feet with a slider whose joint has friction, on a ramp, in units of length and mass
/// [m and kg over those], which lands, slides, and stops.
Trajectory LandOnARamp(double length, double mass) {
  std::ostringstream urdf, yaml;
  urdf.precision(17);
  yaml.precision(17);
  const double L = length, m = mass, inertia = mass * length * length;
  urdf << "<robot name='box'>"
       << Link("box", 0.608 * m, 0.006 * inertia, 0.006 * inertia, 0.006 * inertia)
       << Link("slider", 1.77 * m, 0.0177 * inertia, 0.0177 * inertia, 0.0177 * inertia)
       << "<joint name='j' type='prismatic'><parent link='box'/><child link='slider'/><origin xyz='"
       << 0.0553 * L << " 0 0'/><axis xyz='0.563 0 -0.8265'/><limit lower='-1e9' upper='1e9' "
       << "effort='1e9' velocity='1e9'/><dynamics friction='" << 10 * m * L
       << "'/></joint></robot>";
  yaml << "base: planar\ngravity: " << 9.81 * L << "\njoints: {friction: all}\n"
       << "efforts: {spring: {kind: joint_spring, joint: j, stiffness: " << 280 * m
       << ", damping: " << m << ", rest: " << 0.0137 * L << "}}\n"
       << "nominal: {positions: {base_z: " << 0.35 * L << ", base_pitch: -0.359}, velocities: "
       << "{base_x: " << -1.84 * L << ", j: " << 1.407 * L << "}}\nconstraints:\n";
  for (const double side : {-1., 1.}) {
    yaml << "  " << (side < 0 ? "l" : "r")
         << ": {kind: plane, link: box, friction: " << (side < 0 ? 0.8 : 0.63) << ", point: ["
         << side * 0.1726 * L << ", 0, " << -0.1983 * L << "], normal: [-0.386, 0, 0.9224]}\n";
  }
  const auto robot = Robot(urdf.str(), yaml.str());
  return Simulate(*robot, robot->nominal().x, Vector(), 0.45, AtTolerance(1e-9));
}

/// How large the force of a joint is beside those of contacts depends on units. Words do not.
TEST(SeveralMotions, JointFrictionIsTheSameInAnyUnits) {
  const auto words = [](const Trajectory& run) {
    std::string all;
    for (const Arc& arc : run.arcs) all += arc.mode.Word(3) + " ";
    return all;
  };
  const Trajectory run = LandOnARamp(1, 1);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_EQ('s', run.arcs.back().mode.Word(3)[0]);
  const double units[][2] = {{1e3, 1e3}, {1e3, 1}, {1, 1e6}, {1e-3, 1e-3}};
  for (const auto& unit : units) {
    const Trajectory other = LandOnARamp(unit[0], unit[1]);
    ASSERT_TRUE(other.status.ok()) << unit[0] << ' ' << unit[1] << other.status.message;
    EXPECT_EQ(words(run), words(other)) << unit[0] << ' ' << unit[1];
    // base_x and base_z, as far as runs at this tolerance agree
    for (int k : {0, 1}) {
      EXPECT_NEAR(run.FinalState()(k), other.FinalState()(k) / unit[0], 1e-5) << unit[0];
    }
  }
}

constexpr char kSlidingCart[] =
    "<robot name='cart'><link name='b'><inertial><mass value='0.2391'/><inertia ixx='0.001797' "
    "ixy='0' ixz='0' iyy='0.001797' iyz='0' izz='0.001797'/></inertial></link><link name='s'>"
    "<inertial><mass value='0.2283'/><inertia ixx='0.002283' ixy='0' ixz='0' iyy='0.002283' "
    "iyz='0' izz='0.002283'/></inertial></link><joint name='j' type='prismatic'>"
    "<parent link='b'/><child link='s'/><origin xyz='0.03409 0 0'/><axis xyz='0.8583 0 -0.5132'/>"
    "<limit lower='-1e5' upper='1e5' effort='1e9' velocity='1e9'/><dynamics friction='2'/>"
    "</joint></robot>";
constexpr char kSlidingCartYaml[] =
    "base: planar\njoints: {friction: all}\n"
    "efforts: {s: {kind: joint_spring, joint: j, stiffness: 130.9, rest: -0.009277}}\n"
    "nominal: {positions: {base_z: 0.4835}, velocities: {base_x: -1.248, j: 0.682}}\n"
    "constraints:\n"
    "  l: {kind: plane, friction: 0.002827, link: b, point: [-0.1502, 0, -0.2867], "
    "normal: [0.3031, 0, 0.953]}\n"
    "  r: {kind: plane, friction: 1.2, link: b, point: [0.1502, 0, -0.2867], "
    "normal: [0.3031, 0, 0.953]}\n";

/// Feet that stick stay so where the joint above them stops: what rounding leaves of their slips
/// along the arc before was taken for slips of the perturbed run, for which no forces fit.
TEST(SeveralMotions, AJointThatStopsOverFlatFeetHasADerivative) {
  const auto robot = Robot(kSlidingCart, kSlidingCartYaml);
  const Vector x = robot->nominal().x;
  const auto end = [&](const Vector& start) {
    return Simulate(*robot, start, Vector(), 0.35, AtTolerance(1e-12));
  };
  const Trajectory run = end(x);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ("sss", run.arcs.back().mode.Word(3));
  const BDerivative B = DifferentiateOutcome(*robot, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (const double sign : {-1., 1.}) {
    const Vector w = sign * Vector::Unit(10, 8);  // of the joint's rate
    constexpr double kPart = 1e-6;
    const Vector quotient = (end(x + kPart * w).FinalState() - run.FinalState()) / kPart;
    // Of first order in the part, beside the runs' own errors over it.
    EXPECT_LT((quotient - B(w)).cwiseAbs().maxCoeff(), 1e-3) << sign;
  }
}

}  // namespace
}  // namespace contact_flow
