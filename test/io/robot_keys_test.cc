// SPDX-License-Identifier: BSD-3-Clause
// Keys of a robot's YAML beside constraints and efforts: mimic joints and gears, limits, damping
// and rotors of joints, soles, each against a closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/io/robot_summary.h"
#include "test/io/controlled_robots.h"

namespace contact_flow {
namespace {

std::string Mass(const std::string& name, double mass, const std::string& more = "") {
  const std::string m = "\"" + std::to_string(mass) + "\"";
  return "<link name=\"" + name + "\"><inertial><mass value=" + m + "/><inertia ixx=" + m +
         " iyy=" + m + " izz=" + m + " ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>" + more +
         "</link>\n";
}
std::string ZSlide(const std::string& name, const std::string& child, const std::string& more = "",
                   const std::string& type = "prismatic", const std::string& parent = "world") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child +
         "\"/><axis xyz=\"0 0 1\"/><limit lower=\"-0.5\" "
         "upper=\"0.25\" effort=\"1\" velocity=\"1\"/>" +
         more + "</joint>\n";
}

/// Of links and joints in the world.
RobotSystem Load(const std::string& content, const std::string& yaml) {
  return test::Make(test::Robot(content), yaml);
}
std::string Refused(const std::string& content, const std::string& yaml) {
  return test::RefusalOf([&] { Load(content, yaml); });
}
void ExpectWords(const std::string& answer, const std::string& words) {
  EXPECT_NE(std::string::npos, answer.find(words)) << "\"" << answer << "\" lacks " << words;
}

/// Errors of one-sided quotients fall with slope 1, or are all of them rounding.
void ExpectSlope(const RobotSystem& system, const Vector& x, double duration, const Vector& w) {
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-11;
  const Trajectory run = Simulate(system, x, system.nominal().u, duration, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const BDerivative B = DifferentiateOutcome(system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const QuotientReport report =
      CompareWithQuotients(system, x, system.nominal().u, duration, w, B(w), {1e-3, 1e-4, 1e-5});
  for (const QuotientSample& sample : report.samples) {
    ASSERT_TRUE(sample.status.ok()) << sample.status.message;
    EXPECT_LE(sample.error, 1e3 * sample.alpha * (1 + B(w).norm()) + 1e-6);
  }
  if (!std::isnan(report.slope)) {
    EXPECT_NEAR(1, report.slope, 0.1);
  }
}

const char kPush[] =
    "efforts: {push: {kind: actuator, joint: a, input: u}}, "
    "nominal: {inputs: {u: 3}}";

/// Two masses coupled q_b = k q_a + c, pushed at a by F and along −z by gravity:
///   (m_a + k² m_b) q̈_a = F − (m_a + k m_b) g,    λ = m_b (k q̈_a + g).
TEST(RobotKeys, AMimicJointIsABilateralConstraint) {
  const double ma = 1, mb = 2, k = -1.5, c = 0.1, g = 9.81, F = 3;
  const RobotSystem system =
      Load(Mass("a", ma) + Mass("b", mb) + ZSlide("a", "a") +
               ZSlide("b", "b", "<mimic joint=\"a\" multiplier=\"-1.5\" offset=\"0.1\"/>"),
           std::string("{") + kPush + "}");
  ASSERT_EQ(std::vector<std::string>{"b_mimic"}, system.description().bilateral);
  EXPECT_NEAR(c, system.nominal().x(1), 1e-15);  // where its master sends it
  const double duration = 0.3;
  const Trajectory run = Simulate(system, system.nominal().x, system.nominal().u, duration);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const double acceleration = (F - (ma + k * mb) * g) / (ma + k * k * mb);
  const Vector x = run.FinalState();
  // A parabola: exact but for rounding.
  EXPECT_NEAR(0.5 * acceleration * duration * duration, x(0), 1e-12);
  EXPECT_NEAR(k * x(0) + c, x(1), 1e-12);
  EXPECT_NEAR(acceleration * duration, x(2), 1e-12);
  EXPECT_NEAR(k * x(2), x(3), 1e-12);
}

TEST(RobotKeys, AMimicJointHasItsDerivativeThroughAStop) {
  const RobotSystem system =
      Load(Mass("a", 1) + Mass("b", 2) + ZSlide("a", "a") +
               ZSlide("b", "b", "<mimic joint=\"a\" multiplier=\"-1.5\" offset=\"0.1\"/>"),
           std::string("{joints: {limits: [a], restitution: 0.5}, ") + kPush + "}");
  // q̈_a = 22.62/5.5 = 4.1 m/s² upwards: a stop at 0.25 m is hit at 0.35 s, once in half a second.
  Vector w(4);
  w << 1, -1.5, 0.4, -0.6;  // along the coupling
  ExpectSlope(system, system.nominal().x, 0.5, w);
}

/// A parallelogram: two rods of length l and a bar between their ends, which does not turn, swing
/// as one pendulum, (2 I + 2 m (l/2)² + M l²) θ̈ = −(m + M) g l sin θ, θ from hanging.
TEST(RobotKeys, AFourBarLinkageSwingsAsAPendulum) {
  const double l = 0.5, g = 9.81;
  const auto rod = [](const std::string& name) {
    return "<link name=\"" + name +
           "\"><inertial><origin xyz=\"0 0 -0.25\"/><mass value=\"1\"/><inertia ixx=\"0.02\" "
           "iyy=\"0.02\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>";
  };
  const auto pin = [](const std::string& name, const std::string& parent, const std::string& child,
                      const std::string& xyz) {
    return "<joint name=\"" + name + "\" type=\"continuous\"><parent link=\"" + parent +
           "\"/><child link=\"" + child + "\"/><origin xyz=\"" + xyz +
           "\"/><axis xyz=\"0 -1 0\"/></joint>";
  };
  const RobotSystem system = Load(
      rod("left") + rod("right") + Mass("bar", 2) + pin("a", "world", "left", "0 0 0") +
          pin("b", "world", "right", "0.8 0 0") + pin("c", "left", "bar", "0 0 -0.5"),
      "{closures: {loop: {link: bar, point: [0.8, 0, 0], other_link: right, other_point: [0, 0, "
      "-0.5], axes: xz}}, nominal: {positions: {a: 0.6, b: 0.6, c: -0.6}}}");
  const double inertia = 2 * 0.02 + 2 * 0.25 * l * l + 2 * l * l, pull = (1 + 2) * g * l;
  const double duration = 1.3;
  double theta = 0.6, rate = 0;
  constexpr int kSteps = 13000;  // Runge and Kutta's rule of order 4: h⁴ = 1e-16
  const double h = duration / kSteps;
  const auto f = [&](double angle) { return -pull / inertia * std::sin(angle); };
  for (int k = 0; k < kSteps; ++k) {
    const double k1 = f(theta), r2 = rate + 0.5 * h * k1, k2 = f(theta + 0.5 * h * rate),
                 r3 = rate + 0.5 * h * k2, k3 = f(theta + 0.5 * h * r2), r4 = rate + h * k3,
                 k4 = f(theta + h * r3);
    theta += h / 6 * (rate + 2 * r2 + 2 * r3 + r4);
    rate += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-11;
  const Trajectory run = Simulate(system, system.nominal().x, Vector(0), duration, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const auto& names = system.description().coordinates;
  for (int k = 0; k < 3; ++k) {
    const double sign = names[k] == "c" ? -1 : 1;
    EXPECT_NEAR(sign * theta, run.FinalState()(k), 1e-8) << names[k];
    EXPECT_NEAR(sign * rate, run.FinalState()(3 + k), 1e-7) << names[k];
  }
  Vector w(6);
  for (int k = 0; k < 3; ++k) w(k) = w(3 + k) = names[k] == "c" ? -1 : 1;
  ExpectSlope(system, system.nominal().x, duration, w);
}

/// Two points beside a hinge's axis, on both of its links, held together: two rows for one freedom,
/// at each state of the loop, but not beside it.
TEST(RobotKeys, AClosureThatHoldsAHingeTwiceIsRefusedAtTheStart) {
  const auto turns = [](const std::string& name, const std::string& parent,
                        const std::string& child, const std::string& xyz) {
    return "<joint name=\"" + name + "\" type=\"continuous\"><parent link=\"" + parent +
           "\"/><child link=\"" + child + "\"/><origin xyz=\"" + xyz +
           "\"/><axis xyz=\"0 1 0\"/></joint>";
  };
  const std::string arm = Mass("upper", 1) + Mass("lower", 1) +
                          turns("a", "world", "upper", "0 0 0") +
                          turns("b", "upper", "lower", "0.3 0 0");
  for (const std::string axes : {"x", "xz"}) {
    const RobotSystem system =
        Load(arm,
             "{closures: {bar: {link: upper, point: [0.4, 0, 0.2], other_link: lower, "
             "other_point: [0.1, 0, 0.2], axes: " +
                 axes + "}}, nominal: {positions: {a: 0.3}}}");
    const auto run = [&] { Simulate(system, system.nominal().x, Vector(0), 0.2); };
    if (axes == "x") {
      EXPECT_NO_THROW(run());
    } else {
      ExpectWords(test::RefusalOf(run), "bilateral constraint 'bar_z' depends on those before it");
    }
  }
}

TEST(RobotKeys, AGearIsAClosureOfJoints) {
  const RobotSystem system = Load(
      Mass("a", 1) + Mass("b", 2) + ZSlide("a", "a") + ZSlide("b", "b"),
      std::string("{gravity: 0, closures: {gear: {joint: b, other_joint: a, multiplier: 2}}, ") +
          kPush + "}");
  const Trajectory run = Simulate(system, system.nominal().x, system.nominal().u, 1);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_NEAR(0.5 * 3 / (1 + 4 * 2), run.FinalState()(0), 1e-12);
  EXPECT_NEAR(2 * run.FinalState()(0), run.FinalState()(1), 1e-12);
}

/// A stop with restitution e: from rest under a = F/m to the limit s, there at √(2 a
/// s), back with e.
TEST(RobotKeys, LimitsOfTheUrdfAreStops) {
  const RobotSystem system =
      Load(Mass("a", 1) + ZSlide("a", "a"),
           std::string("{gravity: 0, joints: {limits: all, restitution: 0.5}, ") + kPush + "}");
  ASSERT_EQ((std::vector<std::string>{"a_lower", "a_upper"}), system.description().constraints);
  const double s = 0.25, a = 3, hit = std::sqrt(2 * s / a), speed = a * hit, left = 0.1;
  const Trajectory run = Simulate(system, system.nominal().x, system.nominal().u, hit + left);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_NEAR(hit, run.transitions[0].t, 1e-12);
  EXPECT_NEAR(s - 0.5 * speed * left + 0.5 * a * left * left, run.FinalState()(0), 1e-12);
  Vector w(2);
  w << 0.6, 0.8;
  ExpectSlope(system, system.nominal().x, hit + left, w);
  // A range without zero: the nominal state is in its middle.
  const std::string low = "<limit lower=\"0.25\" upper=\"0.75\" effort=\"1\" velocity=\"1\"/>";
  std::string urdf = Mass("a", 1) + ZSlide("a", "a");
  urdf.replace(urdf.find("<limit"), urdf.find("/>", urdf.find("<limit")) + 2 - urdf.find("<limit"),
               low);
  EXPECT_EQ(0.5, Load(urdf, "joints: {limits: all}").nominal().x(0));
  EXPECT_EQ(0, Load(urdf, "{}").nominal().x(0));
}

/// m v̇ = −d v: v = v₀ e^(−d t/m).
TEST(RobotKeys, DampingOfTheUrdfIsUsedWhereAsked) {
  const RobotSystem system =
      Load(Mass("a", 2) + ZSlide("a", "a", "<dynamics damping=\"0.7\"/>"),
           "{gravity: 0, joints: {damping: all}, nominal: {velocities: {a: 0.1}}}");
  const Trajectory run = Simulate(system, system.nominal().x, Vector(0), 1);
  EXPECT_NEAR(0.1 * std::exp(-0.7 / 2), run.FinalState()(1), 1e-9);
}

/// A pendulum whose joint feels its rotor: (I + J) q̈ = τ; gravity does not feel the rotor.
TEST(RobotKeys, ArmatureIsInertiaOfTheJointAlone) {
  const RobotSystem system = Load(Mass("a", 2) + ZSlide("a", "a", "", "continuous"),
                                  std::string("{joints: {armature: {a: 0.5}}, ") + kPush + "}");
  const Trajectory run = Simulate(system, system.nominal().x, system.nominal().u, 1);
  EXPECT_NEAR(0.5 * 3 / (2 + 0.5), run.FinalState()(0), 1e-12);
  Vector w(2);
  w << 0.6, 0.8;
  ExpectSlope(system, system.nominal().x, 1, w);
  // Weight is not inertia: q̈ = −m g/(m + J).
  const RobotSystem hoist = Load(Mass("a", 2) + ZSlide("a", "a"), "joints: {armature: {a: 3}}");
  const Trajectory fall = Simulate(hoist, hoist.nominal().x, Vector(0), 0.1);
  EXPECT_NEAR(-9.81 * 2 / 5 * 0.1, fall.FinalState()(1), 1e-12);
}

/// A foot of 2 kg on a sole of 0.1 kg that lands alone: the touchdown stops the sole and nothing
/// else, so that two feet that land together have a derivative.
TEST(RobotKeys, ASoleMakesFeetThatLandTogetherDifferentiable) {
  const auto foot = [](double x) {
    return "<collision><origin xyz=\"" + std::to_string(x) +
           " 0 -0.3\"/><geometry><sphere radius=\"0.05\"/></geometry></collision>";
  };
  std::string urdf = "<robot name=\"r\">" + Mass("body", 2) + Mass("left", 0.2, foot(0)) +
                     Mass("right", 0.2, foot(0));
  for (const char* side : {"left", "right"}) {
    urdf += std::string("<joint name=\"") + side + "_leg\" type=\"fixed\"><parent link=\"body\"/>" +
            "<child link=\"" + side + "\"/><origin xyz=\"" + (side[0] == 'l' ? "-0.2" : "0.2") +
            " 0 0\"/></joint>";
  }
  urdf += "</robot>";
  const auto make = [&](const std::string& soles) {
    return RobotSystem(
        ParseRobot(urdf, YAML::Load("{base: planar, contacts: {ground: all}" + soles + "}")), {});
  };
  const RobotSystem bare = make("");
  ASSERT_EQ(2, bare.num_constraints());
  const double fall = std::sqrt(2 * 0.1 / 9.81);
  const auto derivative = [&](const RobotSystem& system, Trajectory* run) {
    *run = Simulate(system, system.nominal().x, Vector(0), fall + 0.02);
    EXPECT_TRUE(run->status.ok()) << run->status.message;
    return DifferentiateOutcome(system, *run).status.ok();
  };
  Trajectory run;
  EXPECT_FALSE(derivative(bare, &run));
  const std::string sole = "{stiffness: 5000, damping: 10, mass: 0.1}";
  const RobotSystem soft = make(", soles: {left: " + sole + ", right: " + sole + "}");
  EXPECT_EQ(3 + 6, soft.dof());
  EXPECT_TRUE(derivative(soft, &run));
  ASSERT_FALSE(run.transitions.empty());
  EXPECT_NEAR(fall, run.transitions[0].t, 1e-10);
  // What lands is the soles: p = 0.1 kg × the speed of the fall.
  EXPECT_NEAR(0.1 * 9.81 * fall, run.transitions[0].impulse(0), 1e-9);
  Vector w = Vector::Zero(2 * soft.dof());
  w(2) = 1;  // pitch
  ExpectSlope(soft, soft.nominal().x, fall + 0.02, w);
}

TEST(RobotKeys, RefuseWithLineValueAndRemedy) {
  const std::string urdf =
      Mass("a", 1) + ZSlide("a", "a") + Mass("b", 1) + ZSlide("turn", "b", "", "continuous");
  const struct {
    const char* yaml;
    const char* words;
  } cases[] = {
      {"joints: {limit: all}", "did you mean 'limits'"},
      {"joints: {limits: [c]}", "joints/limits: unknown joint 'c'"},
      {"joints: {limits: [turn]}", "the URDF gives joint 'turn' no range (line 1)"},
      {"joints: {damping: [a]}", "the URDF gives joint 'a' no damping (line 1)"},
      {"joints: {armature: {a: -1}}", "joints/armature/a is negative (line 1)"},
      {"joints: {armature: {b: 1}}", "unknown joint 'b'"},
      {"joints: {friction: [a]}", "the URDF gives joint 'a' no friction (line 1)"},
      {"soles: {a: {stiffness: 0, mass: 1}}", "soles/a/stiffness is not positive (line 1)"},
      {"soles: {a: {stiffness: 1}}", "'mass' is missing"},
      {"soles: {foot: {stiffness: 1, mass: 1}}", "soles: unknown link 'foot'"},
      {"closures: {c: {joint: a}}", "'other_joint' is missing"},
      {"closures: {c: {joint: a, other_joint: d}}", "closures/c/other_joint: unknown joint 'd'"},
      {"urdf_faults: strickt", "did you mean 'strict'"},
      {"{constraints: {a_lower: {kind: plane, link: a}}, joints: {limits: [a]}}",
       "constraints/a_lower is made by `contacts` or `joints`, too"},
  };
  for (const auto& bad : cases) ExpectWords(Refused(urdf, bad.yaml), bad.words);
}

/// What describe_robot prints makes the same robot again.
TEST(RobotKeys, ADescriptionMakesTheSameRobot) {
  const std::string urdf = "<robot name=\"r\">" +
                           Mass("body", 2,
                                "<collision><geometry><box size=\"0.2 0.3 0.1\"/>"
                                "</geometry></collision>") +
                           Mass("a", 1) + ZSlide("a", "a", "", "prismatic", "body") + "</robot>";
  const YAML::Node document = YAML::Load("{base: floating, joints: {limits: all}}");
  const RobotDescription first = ParseRobot(urdf, document);
  const std::string text = DescribeRobot(first, document, "r.urdf", "");
  EXPECT_NE(std::string::npos, text.find("# r: 2 links, 7 degrees of freedom, 3 kg")) << text;
  const RobotSystem again(ParseRobot(urdf, YAML::Load(text)), {});
  const RobotSystem system(ParseRobot(urdf, document), {});
  ASSERT_EQ(system.description().constraints.size(), again.description().constraints.size());
  ConstraintTerms one, two;
  const Vector q = system.nominal().x.head(system.num_positions());
  system.Constraints(q, Vector::Zero(system.dof()), &one);
  again.Constraints(again.nominal().x.head(again.num_positions()), Vector::Zero(again.dof()), &two);
  EXPECT_LE((one.gap.head(8) - two.gap.head(8)).norm(), 1e-8) << text;
}

/// What would do nothing, or the opposite, is told.
TEST(RobotKeys, WhatIsLikelyAMistakeIsTold) {
  const auto told = [](const RobotSystem& system, const std::string& words) {
    const auto& warnings = system.robot().model.warnings;
    return std::any_of(warnings.begin(), warnings.end(), [&](const std::string& warning) {
      return warning.find(words) != std::string::npos;
    });
  };
  std::string slides = Mass("a", 1) + ZSlide("s", "a") + Mass("b", 1) + ZSlide("t", "b");
  const std::string yaml = "{base: fixed, gravity: -9.81, joints: {limits: all}}";
  EXPECT_FALSE(told(Load(slides, yaml), "no stops"));
  EXPECT_TRUE(told(Load(slides, yaml), "gravity is negative and pulls upward"));
  slides.replace(slides.rfind("\"-0.5\""), 6, "\"0.5\"");
  EXPECT_TRUE(told(Load(slides, yaml),
                   "no stops for these joints, whose lower limit is not below "
                   "the upper one: 't'"));
  const std::string hinge =
      Mass("a", 1) +
      "<joint name=\"h\" type=\"revolute\"><parent link=\"world\"/><child link=\"a\"/>"
      "<limit lower=\"-90\" upper=\"90\" effort=\"1\" velocity=\"1\"/></joint>";
  EXPECT_TRUE(told(Load(hinge, yaml), "'h', -90 to 90 rad, is of many turns"));
  EXPECT_FALSE(told(Load(slides, yaml), "many turns"));
}

}  // namespace
}  // namespace contact_flow
