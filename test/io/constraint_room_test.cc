// SPDX-License-Identifier: BSD-3-Clause
// Robots of more constraints than there is room for are refused when they are loaded.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "contact_flow/dynamics/guards.h"
#include "test/io/controlled_robots.h"

namespace contact_flow {
namespace {

using test::Joint;
using test::Link;
using test::Make;
using test::Refusal;

/// A body that flies, with `count` masses on slides that have stops.
std::string Sleds(int count) {
  std::string content = Link("m0", "1");
  for (int k = 1; k <= count; ++k) {
    const std::string name = "m" + std::to_string(k);
    content += Link(name, "1") + Joint("j" + std::to_string(k), "prismatic", "m0", name, "1 0 0");
  }
  return "<robot name=\"r\">" + content + "</robot>";
}

/// `count` points of the body above a floor.
std::string Points(const std::string& name, int count, const std::string& more) {
  std::string text;
  for (int k = 0; k < count; ++k) {
    text += "  " + name + std::to_string(k) + ": {kind: plane, link: m0, offset: -2" + more + "}\n";
  }
  return text;
}

void ExpectNamed(const std::string& answer, const std::vector<const char*>& words) {
  EXPECT_NE("", answer);
  for (const char* word : words) EXPECT_NE(std::string::npos, answer.find(word)) << answer;
}

TEST(ConstraintRoom, IsAskedForWhenARobotIsLoaded) {
  const std::string urdf = Sleds(0), head = "base: floating\nconstraints:\n";
  const std::string few = head + Points("c", 2048, ", friction: 0.5");
  ASSERT_EQ("", Refusal(urdf, few));
  EXPECT_EQ(6144, Guards(Make(urdf, few)).size());
  ExpectNamed(Refusal(urdf, head + Points("c", 2049, ", friction: 0.5")),
              {"2049 constraints (2049 of `constraints` (line 3))", "of which 2049 have friction",
               "6147", "6144 at most", "leave out friction"});
  ExpectNamed(Refusal(urdf, head + Points("c", 6145, "")),
              {"6145 constraints", "line 3", "at most 6144", "leave out `constraints`"});
}

TEST(ConstraintRoom, SaysWhatCounts) {
  const std::string urdf = Sleds(31),
                    head = "base: floating\njoints:\n  limits: all\nconstraints:\n";
  ASSERT_EQ("", Refusal(urdf, head + Points("c", 2027, ", friction: 0.5")));
  const std::string yaml = head + Points("c", 2028, ", friction: 0.5");
  ExpectNamed(
      Refusal(urdf, yaml),
      {"2090 constraints (2028 of `constraints` (line 5), 62 stops of `joints/limits` (line 3))",
       "of which 2028 have friction", "6146", "6144 at most", "list the joints"});
  const std::string answer = test::RefusalOf([&] { MakeRobot({urdf, yaml, "robots/sleds.yaml"}); });
  EXPECT_EQ(0u, answer.find("robots/sleds.yaml: 2090 constraints")) << answer;
}

TEST(ConstraintRoom, CountsContactsThatAreMade) {
  const std::string urdf =
      "<robot name=\"r\"><link name=\"a\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" "
      "iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial><collision><geometry><box "
      "size=\"1 1 1\"/></geometry></collision></link></robot>";
  std::string yaml = "base: floating\ncontacts: {ground: all, friction: 0.5}\nconstraints:\n";
  for (int k = 0; k < 2041; ++k) {
    yaml += "  c" + std::to_string(k) + ": {kind: plane, link: a, offset: -9, friction: 0.1}\n";
  }
  ExpectNamed(Refusal(urdf, yaml),
              {"2049 constraints (2041 of `constraints` (line 4), 8 of `contacts` (line 2))",
               "fewer `vertices`"});
}

/// Contacts without friction that share forces have a guard only beside few others.
TEST(ConstraintRoom, WarnsWhereSharedForcesHaveNone) {
  const std::string urdf = Sleds(20),
                    head = "base: floating\njoints: {limits: all}\nconstraints:\n";
  const auto warned = [&](const std::string& yaml) {
    const std::vector<std::string> warnings = Make(urdf, yaml).robot().model.warnings;
    return std::any_of(warnings.begin(), warnings.end(), [](const std::string& warning) {
      return warning.find("`friction: 0`") != std::string::npos &&
             warning.find("at most 2048") != std::string::npos;
    });
  };
  const std::string rough = Points("r", 2007, ", friction: 0.5");
  EXPECT_TRUE(warned(head + Points("c", 3, "") + rough));
  EXPECT_FALSE(warned(head + Points("c", 3, "")));
  EXPECT_FALSE(warned(head + Points("c", 2, "") + rough));
  EXPECT_FALSE(warned(head + Points("c", 3, ", friction: 0") + rough));
}

}  // namespace
}  // namespace contact_flow
