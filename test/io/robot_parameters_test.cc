// SPDX-License-Identifier: BSD-3-Clause
// What one number, one input and one effort are called: once.
#include <gtest/gtest.h>

#include <set>

#include "test/io/controlled_robots.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

using test::Arm;
using test::Make;
using test::Refusal;

const char kSprings[] =
    "base: fixed\n"
    "efforts:\n"
    "  s: {kind: joint_spring, joint: shoulder, stiffness: 5}\n"
    "  t: {kind: joint_spring, joint: elbow, stiffness: 5}\n";

void ExpectAnswer(const std::string& urdf, const std::string& yaml,
                  const std::vector<const char*>& words) {
  const std::string answer = Refusal(urdf, yaml);
  EXPECT_NE("", answer) << yaml;
  for (const char* word : words) {
    EXPECT_NE(std::string::npos, answer.find(word)) << answer << "\nof " << yaml;
  }
}

/// The first one's value was told, and overwritten by the second one's.
TEST(RobotParameters, HaveNumbersOfTheirOwn) {
  const std::string springs = kSprings;
  ExpectAnswer(Arm(),
               springs +
                   "parameters:\n  stiffness: [s/stiffness, t/stiffness]\n"
                   "  knee: t/stiffness\n",
               {"parameters/knee", "'t/stiffness'", "'stiffness'", "already", "line 7"});
  ExpectAnswer(Arm(), springs + "parameters:\n  k: [s/stiffness, t/stiffness, s/stiffness]\n",
               {"parameters/k names 's/stiffness' twice", "line 6"});
  ExpectAnswer(Arm(), springs + "parameters: {m: links/upper/mass, k: links/upper/mass}",
               {"parameters/k", "'links/upper/mass'", "'m'", "line 5"});
  ExpectAnswer(Arm(), springs + "parameters: {g: gravity, down: gravity}",
               {"parameters/down", "'g'"});
  ExpectAnswer(Arm(),
               springs +
                   "constraints:\n"
                   "  a: {kind: upper_limit, joint: shoulder, upper: 2}\n"
                   "  b: {kind: upper_limit, joint: elbow, upper: 2}\n"
                   "parameters: {all: [a/restitution, b/restitution], one: b/restitution}",
               {"parameters/one", "'b/restitution'", "'all'", "line 8"});
}

/// Each value reaches its number alone, and the derivative by it is that of quotients.
TEST(RobotParameters, SideBySideAreTold) {
  const std::string yaml = std::string(kSprings) +
                           "parameters: {hip: s/stiffness, knee: t/stiffness}\n"
                           "nominal: {positions: {shoulder: 1}}\n";
  const RobotSystem robot = Make(Arm(), yaml, {{"hip", 50}});
  EXPECT_EQ(50, robot.robot().efforts[0]->parts.numbers[0].value);
  EXPECT_EQ(5, robot.robot().efforts[1]->parts.numbers[0].value);
  test::ExpectSlopeOne(Arm(), yaml, 0.3);
}

/// A name that two elements have does not say which of their numbers is meant.
TEST(RobotParameters, NameOneNumber) {
  const std::string both =
      "base: fixed\n"
      "constraints: {post: {kind: box, link: lower, length: 0.2, width: 0.2, height: 0.1, center: "
      "[0, 0, -5], "
      "riser: 0.02}}\n"
      "efforts: {post: {kind: point_spring, link: lower, point: [0, 0, -0.4], other_link: world, "
      "stiffness: 9, length: 0.2}}\n"
      "nominal: {positions: {shoulder: 0.5, elbow: 0.5}}\n";
  ASSERT_EQ("", Refusal(Arm(), both + "parameters: {k: post/stiffness}"));
  ExpectAnswer(Arm(), both + "parameters: {k: post/length}",
               {"parameters/k", "'post/length'", "two numbers", "line 5"});
}

/// Robots that are made without a file are asked, too.
TEST(RobotParameters, OfDescriptionsHaveNumbersOfTheirOwn) {
  RobotDescription robot =
      ParseRobot(Arm(), YAML::Load(std::string(kSprings) + "parameters: {k: s/stiffness}"));
  robot.parameters.push_back(robot.parameters[0]);
  const auto make = [](RobotDescription description) {
    return test::RefusalOf([&] { RobotSystem(std::move(description), {}); });
  };
  robot.parameters[1].parameter.name = "other";
  EXPECT_NE(std::string::npos, make(std::move(robot))
                                   .find("'other' has a number that parameter "
                                         "'k' has"));
  robot = ParseRobot(Arm(), YAML::Load(std::string(kSprings) + "parameters: {k: s/stiffness}"));
  robot.parameters.push_back(robot.parameters[0]);
  EXPECT_NE(std::string::npos, make(std::move(robot)).find("has two parameters 'k'"));
}

/// An input twice was a second one that moves nothing.
TEST(RobotParameters, InputsAreNamedOnce) {
  ExpectAnswer(Arm(),
               "base: fixed\ninputs: [u, w, u]\n"
               "efforts: {a: {kind: actuator, joint: elbow, input: u}}",
               {"inputs names 'u' twice", "line 2"});
}

/// Joints with friction that are named twice had it twice; efforts of one name were two.
TEST(RobotParameters, MadeElementsAreNamedOnce) {
  const std::string urdf = test::Robot(
      test::Link("a", "1", "-0.3") +
      "<joint name=\"j\" type=\"continuous\"><parent link=\"world\"/><child link=\"a\"/><axis "
      "xyz=\"0 1 0\"/><dynamics damping=\"0.1\" friction=\"0.2\"/></joint>");
  ASSERT_EQ("", Refusal(urdf, "base: fixed\njoints: {friction: [j], damping: [j]}"));
  ExpectAnswer(urdf, "base: fixed\njoints: {friction: [j, j]}",
               {"joints/friction names 'j' twice", "line 2"});
  ExpectAnswer(urdf,
               "base: fixed\njoints: {damping: all}\nefforts:\n"
               "  j_damping: {kind: joint_spring, joint: j, stiffness: 1}",
               {"efforts/j_damping", "`joints`", "rename", "line 4"});
}

/// No robot that is shipped has two numbers of one name.
TEST(RobotParameters, NamesOfNumbersDiffer) {
  std::vector<std::string> robots = AllRobots();
  for (const std::string& robot : RobotsWithFriction()) robots.push_back(robot);
  for (const std::string& name : robots) {
    const auto robot = LoadRobot(RobotFile(name));
    std::set<std::string> names;
    for (const ExposedNumber& number : ListNumbers(robot->robot())) {
      EXPECT_TRUE(names.insert(number.parameter.name).second)
          << name << ' ' << number.parameter.name;
    }
  }
}

}  // namespace
}  // namespace contact_flow
