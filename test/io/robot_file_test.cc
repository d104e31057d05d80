// SPDX-License-Identifier: BSD-3-Clause
// Robots from files: what is read, and what is refused with which words.
#include "contact_flow/io/robot_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <sstream>

#include "test/damaged_text.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

std::string Read(const std::string& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// What comes of the planar biped's URDF with this YAML: the message of a refusal, or "".
std::string BipedAnswer(const std::string& yaml) {
  static const std::string yaml_path = RobotFile("planar_biped");
  static const std::string urdf = Read(yaml_path.substr(0, yaml_path.size() - 4) + "urdf");
  try {
    RobotSystem system(ParseRobot(urdf, YAML::Load(yaml)), {});
  } catch (const std::invalid_argument& error) {
    return error.what();
  } catch (const YAML::Exception& error) {
    return error.what();
  }
  return "";
}

TEST(RobotFile, ShippedRobotsLoad) {
  for (const std::string& robot : ShippedRobots()) {
    const std::unique_ptr<RobotSystem> system = LoadRobot(RobotFile(robot));
    EXPECT_EQ(robot, system->description().name);
    EXPECT_GT(system->num_constraints(), 0);
    EXPECT_FALSE(system->description().parameters.empty());
    ConstraintTerms terms;
    system->Constraints(system->nominal().x.head(system->num_positions()),
                        system->nominal().x.tail(system->dof()), &terms);
    for (int i = 0; i < system->num_constraints(); ++i) {
      EXPECT_GE(terms.gap(i), 0) << robot << ' ' << system->description().constraints[i];
    }
  }
  for (const std::string& robot : RobotsWithFriction()) {
    const std::unique_ptr<RobotSystem> system = LoadRobot(RobotFile(robot));
    EXPECT_TRUE(system->HasFriction());
    EXPECT_EQ(0u, robot.find(system->description().name)) << "of the URDF";
  }
  EXPECT_EQ(18, LoadRobot(RobotFile("quadruped"))->dof());
  EXPECT_EQ(30, LoadRobot(RobotFile("compliant_quadruped"))->dof());
}

TEST(RobotFile, ParametersReachTheirNumbers) {
  const auto one = LoadRobot(RobotFile("planar_biped"), {{"torso_mass", 5}, {"stiffness", 30}});
  const RobotDescription& robot = one->robot();
  EXPECT_EQ(5, robot.model.FindLink("torso").inertia.mass);
  for (const auto& effort : robot.efforts) EXPECT_EQ(30, effort->parts.numbers[0].value);
  EXPECT_THROW(LoadRobot(RobotFile("planar_biped"), {{"torso_mas", 5}}), std::invalid_argument);
  EXPECT_THROW(LoadRobot(RobotFile("planar_biped"), {{"torso_mass", 0}}), std::invalid_argument);
}

TEST(RobotFile, RefusesWithWordsThatNameThePlace) {
  ASSERT_EQ("", BipedAnswer("base: planar"));
  const struct {
    const char* yaml;
    std::vector<const char*> words;
  } cases[] = {
      {"bas: planar", {"unknown key 'bas'", "did you mean 'base'", "line 1"}},
      {"base: flying", {"unknown base 'flying'", "did you mean", "line 1"}},
      {"base: planar\ngravity: nan", {"gravity", "line 2"}},
      {"constraints:\n  foot: {kind: plan, link: left_foot}",
       {"unknown constraints/foot/kind 'plan'", "'plane'", "line 2"}},
      {"constraints:\n  foot: {link: left_foot}",
       {"constraints/foot: 'kind' is missing", "line 2"}},
      {"constraints:\n  foot: {kind: plane, link: left_fot}",
       {"unknown link 'left_fot'", "'left_foot'", "line 2"}},
      {"constraints:\n  foot: {kind: plane, link: left_foot, ofset: 1}",
       {"unknown key 'ofset'", "'offset'", "line 2"}},
      {"constraints:\n  foot: {kind: plane, link: left_foot, point: [0, 1]}",
       {"constraints/foot/point", "a list of 3 numbers"}},
      {"constraints:\n  foot: {kind: plane, link: left_foot, point: [0, 1, x]}",
       {"constraints/foot/point[2]", "'x'", "a number"}},
      {"constraints:\n  foot: {kind: plane, link: left_foot, restitution: 1.5}",
       {"restitution", "line 2"}},
      {"constraints:\n  foot: {kind: plane, link: left_foot, normal: [0, 0, 0]}",
       {"foot/normal has no direction", "line 2"}},
      {"base: planar\nconstraints:\n  foot: {kind: plane, link: left_foot, friction: -0.1}",
       {"constraints/foot/friction is -0.1", "not negative", "no_slip", "line 3"}},
      {"base: planar\nconstraints:\n  foot: {kind: plane, link: left_foot, friction: .nan}",
       {"constraints/foot/friction", ".nan", "or no_slip", "line 3"}},
      {"base: planar\nconstraints:\n  foot: {kind: plane, link: left_foot, friction: rough}",
       {"constraints/foot/friction is 'rough'", "a number or no_slip", "line 3"}},
      {"base: planar\nconstraints:\n  foot: {kind: plane, link: left_foot, friction: [0.5]}",
       {"constraints/foot/friction", "line 3"}},
      {"base: planar\nconstraints:\n  stop: {kind: lower_limit, joint: left_knee, lower: 0, "
       "friction: 0.5}",
       {"constraints/stop/friction", "no contact of two surfaces", "line 3"}},
      {"base: planar\njoints: {limits: all, friction: 0.5}",
       {"joints/friction: unknown joint '0.5'", "line 2"}},
      {"base: planar\ncontacts: {ground: none, friction: -1}",
       {"contacts/friction is -1", "line 2"}},
      {"base: planar\nconstraints:\n  foot: {kind: plane, link: left_foot, friction: "
       "no_slip}\nparameters:\n  mu: foot/friction",
       {"unknown number 'foot/friction'", "line 5"}},
      {"constraints:\n  foot: {kind: plane, link: torso}", {"do not move"}},
      {"base: planar\nconstraints:\n  foot: {kind: plane, link: torso, normal: [0, 1, 0]}",
       {"'foot' is degenerate"}},
      {"constraints:\n  stop: {kind: lower_limit, joint: left_kne, lower: 0}",
       {"unknown joint 'left_kne'", "'left_knee'"}},
      {"constraints:\n  stop: {kind: lower_limit, joint: left_knee}", {"'lower' is missing"}},
      {"constraints: [1, 2]", {"constraints is a list"}},
      {"efforts:\n  s: {kind: joint_sprin, joint: left_hip}", {"'joint_spring'", "line 2"}},
      {"efforts:\n  s: {kind: joint_spring, joint: left_hip, stiffness: -3}", {"stiffness", "-3"}},
      {"efforts:\n  s: {kind: point_spring, link: torso, other_link: torso, length: 1}",
       {"effort 's'", "do not move"}},
      {"base: planar\nefforts:\n  s: {kind: point_spring, link: torso, other_link: torso, length: "
       "1}",
       {"efforts", "not finite"}},
      {"inputs: [torque]\nefforts:\n  a: {kind: actuator, joint: left_hip, input: torqe}",
       {"unknown input 'torqe'", "'torque'"}},
      {"closures:\n  c: {link: left_foot, other_link: right_foot, axes: xw}", {"closures/c/axes"}},
      {"closures:\n  c: {link: left_foot, other_link: right_foot, axes: xx}", {"closures/c/axes"}},
      {"parameters:\n  m: links/torso/mas", {"unknown number", "'links/torso/mass'", "line 2"}},
      {"parameters:\n  m: [links/torso/mass, links/left_thigh/mass]", {"not equal"}},
      {"parameters:\n  m: []", {"names no number"}},
      {"base: planar\nnominal:\n  positions: {base_y: 1}", {"unknown key 'base_y'", "line 3"}},
      {"base: floating\nnominal:\n  positions: {base_qw: 0.5}", {"quaternion", "base_qw"}},
      {"nominal: {duration: -1}", {"nominal/duration"}},
      {"base: planar\nbase: planar", {"given twice"}},
      {"[1, 2", {"line"}},
      {"constraints:\n  foot: 3", {"constraints/foot is '3'"}},
  };
  for (const auto& bad : cases) {
    const std::string answer = BipedAnswer(bad.yaml);
    EXPECT_NE("", answer) << bad.yaml;
    for (const char* words : bad.words) {
      EXPECT_NE(std::string::npos, answer.find(words)) << answer << "\nof " << bad.yaml;
    }
  }
}

/// An arm that hangs straight moves its tip along the floor at first.
TEST(RobotFile, ContactsMayStandStillInTheNominalState) {
  const std::string urdf =
      "<robot name=\"arm\"><link name=\"ground\"/><link name=\"arm\"><inertial><origin xyz=\"0 0 "
      "-0.5\"/><mass value=\"1\"/><inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" "
      "iyz=\"0\" izz=\"0.1\"/></inertial></link><joint name=\"hinge\" type=\"continuous\"><parent "
      "link=\"ground\"/><child link=\"arm\"/><origin xyz=\"0 0 2\"/><axis xyz=\"0 1 "
      "0\"/></joint></robot>";
  const std::string tip = "constraints:\n  tip: {kind: plane, link: arm, point: [0, 0, -1]";
  EXPECT_EQ(1, MakeRobot({urdf, tip + "}", ""})->num_constraints());
  EXPECT_THROW(MakeRobot({urdf, tip + ", offset: 1}", ""}), std::invalid_argument) << "it touches";
}

/// Contacts that are made have the friction of `contacts`, or of their surface.
TEST(RobotFile, MadeContactsHaveFriction) {
  const std::string urdf =
      "<robot name=\"ball\"><link name=\"ball\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" "
      "iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial><collision><geometry><sphere "
      "radius=\"0.1\"/></geometry></collision></link></robot>";
  const std::string base =
      "base: floating\nterrain: {floor: {kind: plane}, ice: {kind: plane, "
      "normal: [0.1, 0, 1], friction: 0.1}, wall: {kind: plane, "
      "normal: [1, 0, 0], offset: -2, friction: no_slip}}\n"
      "contacts: {ground: all";
  const auto robot = MakeRobot({urdf, base + ", friction: 0.5}", ""});
  ASSERT_EQ(3u, robot->friction().size());
  EXPECT_EQ(0.5, robot->friction()[0].coefficient);
  EXPECT_EQ(0.1, robot->friction()[1].coefficient);
  EXPECT_EQ(Friction::kNoSlip, robot->friction()[2].coefficient);
  EXPECT_EQ(6, robot->num_tangential());
  const auto mixed = MakeRobot({urdf, base + "}", ""});  // the floor has none
  EXPECT_EQ(0, mixed->friction()[0].dimension);
  EXPECT_EQ(4, mixed->num_tangential());
  const auto planar = MakeRobot({urdf, "base: planar\ncontacts: {ground: all, friction: 0}", ""});
  EXPECT_EQ(1, planar->num_tangential()) << "given, and can be set";
}

TEST(RobotFile, TakesUrdfAsTextAsPathOrAsNamed) {
  const std::string yaml = RobotFile("monoped"), urdf = yaml.substr(0, yaml.size() - 4) + "urdf";
  const std::string text = Read(urdf);
  EXPECT_EQ(text, ReadRobotTexts(yaml).urdf);
  EXPECT_EQ(text, ReadRobotTexts(yaml, urdf).urdf);
  EXPECT_EQ(text, ReadRobotTexts(yaml, text).urdf);
  EXPECT_EQ(text, ReadRobotTexts(yaml, "", "usual").urdf) << "the YAML names one";
  EXPECT_EQ("  <a/>", ReadRobotTexts(yaml, "  <a/>").urdf);
  EXPECT_THROW(ReadRobotTexts(yaml, "/no/such.urdf"), std::invalid_argument);
  const RobotTexts texts = ReadRobotTexts(yaml);
  EXPECT_EQ("monoped", MakeRobot(texts)->description().name);
  EXPECT_EQ(3, MakeRobot({texts.urdf, "base: fixed", ""})->dof());
  EXPECT_THROW(MakeRobot({texts.urdf, "[1, 2]", ""}), std::invalid_argument);
  EXPECT_THROW(MakeRobot({texts.urdf, std::string(kMaxRobotYamlBytes + 1, ' '), ""}),
               std::invalid_argument);
}

TEST(RobotFile, NamesTheFileThatCannotBeRead) {
  try {
    LoadRobot("/no/such/robot.yaml");
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string::npos, std::string(error.what()).find("/no/such/robot.yaml"));
  }
}

/// As for URDF: damaged files are read or refused, never anything else.
TEST(RobotFile, SurvivesDamagedTexts) {
  std::mt19937 generator(5);
  const std::string whole = Read(RobotFile("planar_biped"));
  ASSERT_EQ("", BipedAnswer(whole));
  const std::vector<const char*> pieces = {":",     "- ", "{",   "}",           "[",   "]",
                                           "\n",    "  ", "&a ", "*a",          "nan", ".inf",
                                           "1e999", "~",  "''",  "kind: plane", "? ",  "!!binary "};
  int refused = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const std::string text = test::Damaged(whole, pieces, 30, &generator);
    refused += !BipedAnswer(text).empty();
  }
  EXPECT_GT(refused, 300);
}

}  // namespace
}  // namespace contact_flow
