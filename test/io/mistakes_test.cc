// SPDX-License-Identifier: BSD-3-Clause
// What goes wrong when a robot is set up, and what the answer says of it: where,
// what, and what to do.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <vector>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "src/io/xacro.h"

namespace contact_flow {
namespace {

// Line by line, so that answers can name lines.
const char kUrdf[] = R"(<robot name="hopper">
<link name="body"><inertial><mass value="2"/>
  <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><box size="0.2 0.2 0.1"/></geometry></collision></link>
<link name="foot"><inertial><mass value="0.5"/>
  <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<joint name="leg" type="prismatic"><parent link="body"/><child link="foot"/>
  <origin xyz="0 0 -0.5"/><axis xyz="0 0 1"/>
  <limit lower="-0.1" upper="0.1" effort="50" velocity="3"/></joint>
</robot>)";

std::string Replaced(const std::string& from, const std::string& to) {
  std::string text = kUrdf;
  const std::size_t at = text.find(from);
  EXPECT_NE(std::string::npos, at) << from;
  return text.replace(at, from.size(), to);
}

/// The message of the refusal to load and start the robot, or "". What loads and does not start
/// has been told before, by a warning.
std::string Answer(const std::string& urdf, const std::string& yaml) {
  std::string warnings;
  try {
    const RobotSystem system(ParseRobot({urdf, yaml, "robot.yaml"}), {});
    for (const std::string& warning : system.robot().model.warnings) warnings += warning + "\n";
    InitialMode(system, system.nominal().x, system.nominal().u);
  } catch (const std::invalid_argument& error) {
    return warnings + error.what();
  }
  return "";
}

struct Mistake {
  std::string urdf, yaml;
  std::vector<const char*> words;
};

void ExpectAnswers(const std::vector<Mistake>& mistakes) {
  ASSERT_EQ("", Answer(kUrdf, "base: floating"));
  for (const Mistake& mistake : mistakes) {
    const std::string answer = Answer(mistake.urdf, mistake.yaml);
    EXPECT_TRUE(std::regex_search(answer, std::regex("line [0-9]"))) << "no line: " << answer;
    for (const char* words : mistake.words) {
      EXPECT_NE(std::string::npos, answer.find(words))
          << "\"" << answer << "\" lacks \"" << words << "\"; of " << mistake.yaml;
    }
  }
}

TEST(Mistakes, OfTheYaml) {
  const std::string u = kUrdf;
  const std::string foot = "base: floating\nconstraints:\n  foot: ";
  ExpectAnswers({
      {u, "base: flaoting", {"robot.yaml", "unknown base 'flaoting'", "'floating'", "(line 1)"}},
      {u, "Base: floating", {"unknown key 'Base'", "'base'", "(line 1)"}},
      {u, "base: floating\ncontact: {ground: feet}", {"unknown key 'contact'", "(line 2)"}},
      {u, "base: floating\ncontacts: feet", {"contacts is 'feet', expected a map", "(line 2)"}},
      {u,
       "base: floating\ncontacts: {ground: feets}",
       {"unknown link 'feets'", "feet, all, none", "(line 2)"}},
      {u,
       "base: floating\ncontacts: {ground: all, height: low}",
       {"contacts/height is 'low', expected a number", "(line 2)"}},
      {u,
       "base: floating\ncontacts: {ground: all, restitution: -0.1}",
       {"contacts/restitution is -0.1, expected 0 to 1", "(line 2)"}},
      {u,
       foot + "{kind: plain, link: foot}",
       {"constraints/foot/kind 'plain'", "'plane'", "line 3"}},
      {u, foot + "{kind: plane, link: Foot}", {"unknown link 'Foot'", "'foot'", "(line 3)"}},
      {u, foot + "{kind: plane}", {"constraints/foot: 'link' is missing", "line 3"}},
      {u, foot + "{kind: plane, link: foot, frcition: 0.5}", {"unknown key 'frcition'", "line 3"}},
      {u, foot + "{kind: plane, link: foot, radius: 5 cm}", {"radius is '5 cm'", "line 3"}},
      {u, foot + "{kind: plane, link: foot, radius: -0.05}", {"radius", "-0.05", "line 3"}},
      {u, foot + "{kind: plane, link: foot, point: 0}", {"foot/point", "a list of 3", "line 3"}},
      {u,
       foot + "{kind: plane, link: foot, normal: [0, 0, 0]}",
       {"foot/normal has no direction", "[0, 0, 1]", "(line 3)"}},
      {u,
       foot + "{kind: rim, link: foot, radius: 0.1}",
       {"'foot' is degenerate", "(line 3)", "nominal"}},
      {u,
       foot + "{kind: link_plane, link: foot, other_link: body, normal: [0, 0, 0]}",
       {"foot/normal has no direction", "(line 3)"}},
      {u,
       "base: floating\nclosures:\n  a: {joint: leg, other_joint: base_x}\n"
       "  b: {joint: base_x, other_joint: leg}",
       {"closure 'b' is redundant (line 4)", "leave it out"}},
      {u,
       "base: fixed\nclosures:\n  c: {link: foot, other_link: world, axes: xz}",
       {"closure 'c_x' is degenerate", "(line 3)", "`axes`"}},
      {u, foot + "{kind: lower_limit, joint: knee, lower: 0}", {"unknown joint 'knee'", "line 3"}},
      {u, foot + "{kind: lower_limit, joint: base_qw, lower: 0}", {"unknown joint 'base_qw'"}},
      {u, foot + "{kind: plane, link: foot}\n  foot: {kind: plane, link: body}", {"given twice"}},
      {u,
       "base: floating\nnominal: {positions: {base_z: 0.3}}\nconstraints: {f: {kind: plane, "
       "link: foot}}",
       {"the nominal state penetrates constraint 'f': its gap is -0.2 (line 3); ", "`nominal`",
        "the gap of constraint 'f' is -0.2"}},
      {u,
       "base: floating\nnominal: {positions: {base_z: 0.3}}\nconstraints:\n"
       "  f: {kind: plane, link: foot}\n  g: {kind: plane, link: foot, radius: 0.1}\n"
       "  h: {kind: plane, link: body}",
       {"constraint 'g': its gap is -0.3, the lowest of 2 below 0 (line 5); "}},
      {u, "base: floating\nnominal: {positions: {bas_z: 1}}", {"unknown key 'bas_z'", "'base_z'"}},
      {u, "base: floating\nnominal: {positions: {base_z: high}}", {"base_z is 'high'", "line 2"}},
      {u, "base: floating\nnominal: {positions: {base_qw: 0}}", {"quaternion", "length 0"}},
      {u, "base: floating\nnominal: {inputs: {u: 1}}", {"unknown key 'u'"}},
      {u, "base: floating\nefforts: {s: {kind: srvo, joint: leg}}", {"'srvo'", "'servo'"}},
      {u,
       "base: floating\nefforts: {s: {kind: servo, joint: leg, stiffness: 5}}",
       {"efforts/s: 'input' is missing"}},
      {u,
       "base: floating\nefforts: {s: {kind: servo, joint: leg, input: u}}",
       {"'stiffness' is missing"}},
      {u,
       "base: floating\ninputs: [v]\nefforts: {s: {kind: actuator, joint: leg, input: u}}",
       {"unknown input 'u'", "'v'"}},
      {u, "base: floating\njoints: {limits: [leggg]}", {"unknown joint 'leggg'", "'leg'"}},
      {u,
       "base: floating\njoints: {friktion: all}",
       {"unknown key 'friktion'", "'friction'", "line 2"}},
      {u, "base: floating\nsoles: {foot: {stiffness: 1e3}}", {"'mass' is missing", "line 2"}},
      {u,
       "base: floating\nsoles: {foot: {stiffness: 1e3, mass: 0.1}}\n"
       "constraints: {f: {kind: plane, link: foot}}",
       {"constraints/f/link: 'foot' has a sole, which is what touches: write 'foot_sole'",
        "line 3"}},
      {u,
       "base: floating\nsoles: {foot: {stiffness: 1e3, mass: 0.1}}\ncontacts: {ground: [foot]}",
       {"'foot' has a sole, to which its <collision> went: write 'foot_sole'", "line 3"}},
      {u, "base: floating\nclosures: {c: {joint: leg, other_joint: arm}}", {"unknown joint 'arm'"}},
      {u, "base: floating\nparameters: {m: links/foot/weight}", {"'links/foot/", "line 2"}},
      {u,
       "base: floating\nefforts: {t: {kind: track, joint: leg, feed_forward: f, stiffness: 1, "
       "reference: {times: [0, 1], values: [0, 1]}}}\nnominal: {velocities: {clock: 2}}",
       {"nominal/velocities/clock is not 1", "line 3"}},
      {u, "base: floating: true", {"line 1"}},
      {u,
       "base: floating\ncontacts:\n\tground: feet",
       {"line 3 is indented by a tab", "spaces alone"}},
      {u,
       "base: floating\ncontacts: {ground: all, friction: {mu: 0.8}}",
       {"contacts/friction is a map, expected a number or no_slip", "(line 2)"}},
      {u,
       "base: floating\nnominal: {positions: {base_roll: 0.1}}",
       {"'base_roll'", "the orientation is base_qw, base_qx, base_qy, base_qz", "(line 2)"}},
      {u,
       "base: floating\nnominal: {velocities: {base_qx: 0.1}}",
       {"'base_qx'", "the orientation is base_wx, base_wy, base_wz", "(line 2)"}},
      {u,
       "base: floating\nsoles: {foots: {stiffness: 1e3, mass: 0.1}}",
       {"unknown link 'foots'", "'foot'", "(line 2)"}},
      {u,
       "base: floating\nterrain: nothing.yaml",
       {"terrain: nothing.yaml: cannot be read", "No such file", "(line 2)"}},
      {u,
       "base: floating\njoints: {limits: all}\nconstraints: {leg_lower: {kind: plane, link: foot}}",
       {"leg_lower is made by", "rename it", "(line 3)"}},
      {u,
       "base: floating\nefforts: {s: {kind: servo, joint: leg, input: u, stiffness: 5, speed: 3}}",
       {"efforts/s/speed", "add `stall` or `limit`", "(line 2)"}},
      {u,
       "base: floating\njoints: {limits: all}\nnominal: {positions: {leg: 0.3}}",
       {"constraint 'leg_upper': its gap is -0.2 (line 2)", "'leg_upper' is -0.2",
        "begin elsewhere"}},
      {u,
       foot + "{kind: plane, link: foot, motion: {velocity: 1}}",
       {"foot/motion: 'direction' is missing", "line 3"}},
      {u,
       foot + "{kind: plane, link: foot, motion: {direction: [0, 0, 1], amplitude: 0.1}}",
       {"foot/motion/amplitude needs a `frequency` [Hz]", "(line 3)"}},
      {u, "- base", {"not a map"}},
      {u, "base: floating\n---\nbase: fixed", {"more than one YAML document"}},
  });
}

TEST(Mistakes, OfTheUrdf) {
  const std::string y = "base: floating";
  ExpectAnswers({
      {Replaced("value=\"2\"", "value=\"${mass}\""),
       y,
       {"link 'body'", "${mass}", "xacro", "(line 2)"}},
      {Replaced("value=\"0.5\"", "value=\"0,5\""),
       y,
       {"link 'foot'", "value=\"0,5\"", "not a finite number", "(line 5)"}},
      {Replaced("value=\"0.5\"", "value=\"-0.5\""), y, {"link 'foot': its mass is -0.5"}},
      {Replaced("izz=\"0.01\"", "izz=\"-0.01\""),
       y,
       {"link 'foot': its inertia is not positive definite", "correct <inertia>"}},
      {Replaced("xyz=\"0 0 -0.5\"", "xyz=\"0, 0, -0.5\""),
       y,
       {"joint 'leg'", "\"0, 0, -0.5\"", "3 finite numbers", "(line 9)"}},
      {Replaced("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 0\"/>"), y, {"'leg'", "axis"}},
      {Replaced("child link=\"foot\"", "child link=\"feet\""), y, {"[feet]"}},
      {Replaced("type=\"prismatic\"", "type=\"slider\""), y, {"[leg]", "[slider]"}},
      {Replaced("<limit lower=\"-0.1\" upper=\"0.1\" effort=\"50\" velocity=\"3\"/>", ""),
       y + "\nurdf_faults: strict",
       {"joint 'leg' has no <limit>", "(line 8)"}},
      {Replaced("<child link=\"foot\"/>", "<child link=\"foot\"/><mimic joint=\"arm\"/>"),
       y,
       {"joint 'leg' mimics 'arm'", "unknown joint 'arm'"}},
      {Replaced("<child link=\"foot\"/>", "<child link=\"foot\"/><mimic joint=\"leg\"/>"),
       y,
       {"joint 'leg' mimics itself", "leave its <mimic> out"}},
      {Replaced("</robot>", ""), y, {"ends inside <robot>"}},
      {Replaced("</joint>", ""), y, {"</robot> where <joint> is open", "line"}},
      {Replaced("name=\"leg\"", "name=\"base_z\""),
       y,
       {"two coordinates are called 'base_z'", "rename"}},
      {Replaced("<sphere radius=\"0.05\"/>", "<mesh filename=\"package://p/foot.stl\"/>"),
       "base: floating\ncontacts: {ground: [foot]}",
       {"link 'foot'", "'package://p/foot.stl' is not found", "ROS_PACKAGE_PATH"}},
      {"robot.urdf", y, {"no XML element"}},
  });
}

/// A finger of three hinges and two point masses: straight, they have no velocity along it.
TEST(Mistakes, OfMassesInAStraightPosture) {
  std::string urdf = "<robot name=\"finger\"><link name=\"palm\"/>", parent = "palm";
  for (const char* name : {"a", "b", "c"}) {
    const std::string x = *name == 'a' ? "0" : "0.03";
    urdf += "<link name=\"" + std::string(name) + "\"><inertial><origin xyz=\"" + x +
            " 0 0\"/><mass value=\"0.1\"/><inertia ixx=\"0\" iyy=\"0\" izz=\"0\" ixy=\"0\" "
            "ixz=\"0\" iyz=\"0\"/></inertial></link><joint name=\"turn_" +
            name + "\" type=\"continuous\"><parent link=\"" + parent + "\"/><child link=\"" + name +
            "\"/><origin xyz=\"0.04 0 0\"/><axis xyz=\"0 0 1\"/></joint>";
    parent = name;
  }
  urdf += "</robot>";
  const auto run = [&](const std::string& yaml) {
    const RobotSystem system(ParseRobot({urdf, yaml, "robot.yaml"}), {});
    return Simulate(system, system.nominal().x, system.nominal().u, 0.01).status;
  };
  const Status straight = run("base: fixed");
  for (const char* words : {"the mass matrix is singular", "'turn_a', 'turn_b', 'turn_c'"}) {
    EXPECT_NE(std::string::npos, straight.message.find(words)) << straight.message;
  }
  const Status bent = run("base: fixed\nnominal: {positions: {turn_b: 0.5, turn_c: 0.7}}");
  EXPECT_TRUE(bent.ok()) << bent.message;
}

/// A program called xacro, for RunXacro.
class Xacro : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::TempDir() + "contact_flow_xacro";
    ASSERT_EQ(0, std::system(("mkdir -p " + folder_).c_str()));
    path_ = std::getenv("PATH");
    file_ = folder_ + "/robot.urdf.xacro";
    std::ofstream(file_) << "<robot name=\"r\" xmlns:xacro=\"x\"><xacro:leg/></robot>";
  }
  void TearDown() override {
    ::setenv("PATH", path_.c_str(), 1);
    EXPECT_EQ(0, std::system(("rm -r " + folder_).c_str()));
  }
  void Install(const std::string& script) {
    std::ofstream(folder_ + "/xacro") << "#!/bin/sh\n" << script << "\n";
    ASSERT_EQ(0, std::system(("chmod +x " + folder_ + "/xacro").c_str()));
    ::setenv("PATH", (folder_ + ":" + path_).c_str(), 1);
  }
  std::string Answer() {
    try {
      return RunXacro(file_);
    } catch (const std::invalid_argument& error) {
      return std::string("refused: ") + error.what();
    }
  }
  std::string folder_, path_, file_;
};

TEST_F(Xacro, IsRunOnFilesThatNeedIt) {
  EXPECT_TRUE(IsXacro("a.urdf.xacro", ""));
  EXPECT_TRUE(IsXacro("a.urdf", "<robot><xacro:macro name=\"leg\"/><xacro:leg/></robot>"));
  EXPECT_FALSE(IsXacro("a.urdf", "<robot><!-- <xacro:leg/> --></robot>"));
  Install("echo \"<robot name='made'/>\"; cat \"$1\" > /dev/null");
  EXPECT_EQ("<robot name='made'/>\n", ReadUrdf(file_).urdf);
  Install("echo 'undefined macro: leg' >&2; exit 2");
  EXPECT_NE(std::string::npos, Answer().find("xacro failed: undefined macro: leg")) << Answer();
  ::setenv("PATH", "/nonexistent", 1);
  EXPECT_NE(std::string::npos, Answer().find("install it (ros-noetic-xacro, or pip install xacro)"))
      << Answer();
}

TEST(Mistakes, OfPaths) {
  try {
    ReadUrdf("/no/such/robot.urdf");
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string::npos, std::string(error.what()).find("/no/such/robot.urdf"));
  }
}

}  // namespace
}  // namespace contact_flow
