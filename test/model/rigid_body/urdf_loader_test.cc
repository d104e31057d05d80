// SPDX-License-Identifier: BSD-3-Clause
// What the loader makes of a URDF, and what it refuses, with words that name the place.
#include "contact_flow/model/rigid_body/urdf_loader.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <sstream>

#include "contact_flow/model/rigid_body/kinematics.h"
#include "test/damaged_text.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

std::string Inertial(const std::string& mass, const std::string& inertia) {
  return "<inertial><mass value=\"" + mass + "\"/><inertia " + inertia + "/></inertial>";
}
const char kUnit[] = R"(ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1")";

std::string Body(const std::string& name, const std::string& content = Inertial("1", kUnit)) {
  return "<link name=\"" + name + "\">" + content + "</link>";
}
std::string Joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& content = "") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/>" + content + "</joint>";
}
std::string Urdf(const std::string& content) {
  return "<?xml version=\"1.0\"?>\n<robot name=\"r\">" + content + "</robot>";
}
/// What the loader answers: the message of its refusal, or "".
std::string Answer(const std::string& text, RobotBase base = RobotBase::kFixed) {
  try {
    ParseUrdf(text, base);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

const char kAxis[] = R"(<axis xyz="0 0 1"/>)";
const char kLimit[] = R"(<limit lower="-1" upper="1" effort="1" velocity="1"/>)";

TEST(UrdfLoader, ReadsEveryTypeOfJoint) {
  std::ifstream file(std::string(CONTACT_FLOW_TEST_DATA) + "/everything.urdf");
  std::stringstream text;
  text << file.rdbuf();
  const RobotModel robot = ParseUrdf(text.str(), RobotBase::kFloating);
  EXPECT_EQ("everything", robot.name);
  const std::vector<std::string> expected = {
      "base_x",   "base_y", "base_z", "base_qw", "base_qx", "base_qy",   "base_qz",
      "free_x",   "free_y", "free_z", "free_qw", "free_qx", "free_qy",   "free_qz",
      "shoulder", "elbow",  "slide",  "tray_x",  "tray_y",  "tray_angle"};
  EXPECT_EQ(expected, robot.coordinates);
  EXPECT_EQ(18, robot.tree.dof());
  // Fixed links are one body with their parent, whose mass is both.
  EXPECT_EQ(robot.FindLink("lower_arm").body, robot.FindLink("hand").body);
  EXPECT_NEAR(0.7, robot.tree.bodies()[robot.FindLink("hand").body].inertia.mass, 1e-15);
  ASSERT_EQ(2u, robot.warnings.size());
  EXPECT_NE(std::string::npos, robot.warnings[0].find("limits")) << robot.warnings[0];
  EXPECT_NE(std::string::npos, robot.warnings[1].find("'elbow'")) << robot.warnings[1];
  const RobotModel fixed = ParseUrdf(text.str(), RobotBase::kFixed);
  EXPECT_EQ(12, fixed.tree.dof());
  EXPECT_EQ(-1, fixed.FindLink("trunk").body);
}

TEST(UrdfLoader, PlanarBaseTurnsXTowardsMinusZ) {
  const RobotModel robot = ParseUrdf(Urdf(Body("body")), RobotBase::kPlanar);
  EXPECT_EQ((std::vector<std::string>{"base_x", "base_z", "base_pitch"}), robot.coordinates);
  TreeState<double> state(robot.tree);
  const double q[] = {1, 2, 0.5};
  UpdatePositions(robot.tree, q, &state);
  const RobotModel::Link& body = robot.FindLink("body");
  const Vec3<double> tip =
      PointPosition(state, body.body, Vec3<double>(body.pose * Vec3<double>(1, 3, 0)));
  EXPECT_LE((tip - Vec3<double>(1 + std::cos(0.5), 3, 2 - std::sin(0.5))).norm(), 1e-15);
}

TEST(UrdfLoader, RefusesWithWordsThatNameThePlace) {
  const std::string two = Body("a") + Body("b");
  const auto inertia = [](const std::string& mass, const std::string& numbers) {
    return Urdf(Body("base") + Body("a", Inertial(mass, numbers)) +
                Joint("j", "continuous", "base", "a", kAxis));
  };
  const struct {
    std::string text;
    const char* words;
  } cases[] = {
      {"", "no XML element"},
      {"hello", "no XML element"},
      {"<robot name=\"r\">", "ends inside <robot>"},
      {"<robot name=\"r\"><link name=\"a\"></robot>", "</robot> where <link> is open (line 1)"},
      {"<robot name=\"r\"/><robot name=\"s\"/>", "more than one root"},
      {"<!DOCTYPE robot [<!ENTITY a \"b\">]><robot/>", "document types"},
      {std::string("<robot\0name=\"r\"/>", 17), "byte 0"},
      {"<robot><link name=\"a\"/></robot>", "nothing moves"},
      {"<body/>", "URDF: "},
      {Urdf(""), "URDF: "},
      {Urdf(Body("a")), "nothing moves"},
      {Urdf(two), "URDF: "},
      {Urdf(Body("a") + Body("a")), "'a'"},
      {Urdf(two + Joint("j", "hinge", "a", "b")), "j"},
      {Urdf(two + Joint("j", "continuous", "a", "c")), "c"},
      {Urdf(two + Joint("j", "continuous", "a", "b", R"(<axis xyz="0 0 0"/>)")), "'j'"},
      {Urdf(two + Joint("j", "continuous", "a", "b", R"(<axis xyz="0 nan 0"/>)")), "j"},
      {Urdf(two + Joint("j", "continuous", "a", "b", R"(<axis xyz="0 1"/>)")), "j"},
      {Urdf(two + Joint("j", "continuous", "a", "b", R"(<origin xyz="1e999 0 0"/>)")), "j"},
      {Urdf(two +
            Joint("j", "continuous", "a", "b", std::string(kAxis) + R"(<mimic joint="k"/>)")),
       "joint 'j' mimics 'k'"},
      {Urdf(two + Joint("j", "continuous", "a", "b", kAxis) +
            Joint("k", "continuous", "a", "b", kAxis)),
       "link 'b' is the child of two joints"},
      {Urdf(two + Joint("j", "continuous", "a", "b", kAxis) +
            Joint("k", "continuous", "b", "a", kAxis)),
       "URDF: "},
      {Urdf(two + Body("c") + Body("d") + Joint("i", "continuous", "a", "b", kAxis) +
            Joint("j", "continuous", "c", "d", kAxis) + Joint("k", "continuous", "d", "c", kAxis)),
       "not connected to the root 'a'"},
      // urdfdom takes these for formats of printf.
      {Urdf(two + Joint("j", "%s%s%n", "a", "b", kAxis)), "_s_s_n"},
      {Urdf(two + Joint("j", "continuous", "a", "b", R"(<axis xyz="%s%n 0 1"/>)")), "%s%n"},
      {inertia("0", kUnit), "what they carry an <inertial>: 'j'"},
      {inertia("-1", kUnit), "link 'a': its mass is -1"},
      {inertia("nan", kUnit), "a"},
      {inertia("1e999", kUnit), "a"},
      {inertia("1", R"(ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="3")"), ""},
      {inertia("1", R"(ixx="1" ixy="2" ixz="0" iyy="1" iyz="0" izz="1")"), "positive definite"},
      {inertia("1", R"(ixx="-1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1")"), "positive definite"},
      {inertia("1", R"(ixx="1" ixy="0")"), "a"},
      {Urdf(Body("base") + Body("a", "") + Joint("j", "continuous", "base", "a", kAxis)),
       "move no mass, give what they carry an <inertial>: 'j'"},
      {Urdf(two + Joint("base_x", "prismatic", "a", "b", std::string(kAxis) + kLimit)), ""},
  };
  for (const auto& bad : cases) {
    const std::string answer = Answer(bad.text);
    if (bad.words[0] == '\0') {
      EXPECT_EQ("", answer);
      continue;
    }
    EXPECT_NE("", answer) << bad.text;
    EXPECT_NE(std::string::npos, answer.find(bad.words)) << answer << "\nof " << bad.text;
  }
  EXPECT_NE(std::string::npos,
            Answer(Urdf(two + Joint("base_x", "prismatic", "a", "b", std::string(kAxis) + kLimit)),
                   RobotBase::kFloating)
                .find("two coordinates are called 'base_x'"));
  EXPECT_NE(std::string::npos,
            Answer(Urdf(Body("a", "")), RobotBase::kFloating).find("what moves has no mass"));
}

TEST(UrdfLoader, NamesMayHaveAnyLetters) {
  const RobotModel robot = ParseUrdf(
      Urdf(Body("100 % a") + Body("b") + Joint("%n", "continuous", "100 % a", "b", kAxis)),
      RobotBase::kFixed);
  EXPECT_EQ(std::vector<std::string>{"%n"}, robot.coordinates);
  EXPECT_EQ("100 % a", robot.links[0].name);
}

/// Chains of a million links, and elements nested as deep, are refused before they are parsed.
TEST(UrdfLoader, RefusesWhatIsTooLarge) {
  std::string chain;
  for (int k = 0; k < 1000000; ++k) chain += "<link name=\"l\"/>";
  EXPECT_NE(std::string::npos, Answer(Urdf(chain)).find("bytes"));
  chain.clear();
  for (int k = 0; k < 2000; ++k) {
    chain += Body("l" + std::to_string(k), "");
    if (k > 0) {
      chain += Joint("j" + std::to_string(k), "continuous", "l" + std::to_string(k - 1),
                     "l" + std::to_string(k), kAxis);
    }
  }
  EXPECT_NE(std::string::npos, Answer(Urdf(chain)).find("more than 1000 links"));
  chain.clear();
  for (int k = 0; k < 900; ++k) {
    chain += Body("l" + std::to_string(k));
    if (k > 0) {
      chain += Joint("j" + std::to_string(k), "continuous", "l" + std::to_string(k - 1),
                     "l" + std::to_string(k), kAxis);
    }
  }
  EXPECT_NE(std::string::npos, Answer(Urdf(chain)).find("degrees of freedom"));
  std::string deep;
  for (int k = 0; k < 100000; ++k) deep += "<a>";
  EXPECT_NE(std::string::npos, Answer(deep).find("nested deeper than 100"));
}

/// Texts that are wrong by chance are read or refused, and never anything else: bytes flipped, cut
/// out, doubled and moved in the shipped robots. A fixed seed, so that a failure can be seen again.
TEST(UrdfLoader, SurvivesDamagedTexts) {
  std::mt19937 generator(3);
  const std::vector<const char*> pieces = {
      "nan", "1e999", "-",    "\"",           "<",    ">", "/>",        "</",     "<!--",
      "]]>", "&#0;",  "&lt;", "\xef\xbb\xbf", "\xff", "0", "name=\"\"", "<link/>"};
  int refused = 0;
  for (const std::string& robot : ShippedRobots()) {
    const std::string yaml = RobotFile(robot);
    std::ifstream file(yaml.substr(0, yaml.size() - 4) + "urdf");
    std::stringstream stream;
    stream << file.rdbuf();
    const std::string whole = stream.str();
    ASSERT_EQ("", Answer(whole, RobotBase::kFixed));
    for (int trial = 0; trial < 300; ++trial) {
      const std::string text = test::Damaged(whole, pieces, 40, &generator);
      refused += !Answer(text, RobotBase::kFixed).empty();
    }
  }
  EXPECT_GT(refused, 1000);  // most damage is seen
}

}  // namespace
}  // namespace contact_flow
