// SPDX-License-Identifier: BSD-3-Clause
// Names that are misspelt in a URDF, and tags that xacro left there: by hand, each where it is.
#include "src/model/rigid_body/urdf_spelling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "contact_flow/model/rigid_body/urdf_loader.h"
#include "test/refusal.h"

namespace contact_flow {
namespace {

// Line by line, so that answers can name lines.
const char kKneeUrdf[] = R"(<robot name="r" xmlns:drake="d">
<link name="hip"><inertial><mass value="2"/>
 <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="shin"><inertial><origin xyz="0 0 -0.1"/><mass value="1"/>
 <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
 <collision name="c"><origin xyz="0 0 0"/><geometry><mesh filename="a.stl" scale="1 1 1"/>
 </geometry></collision></link>
<joint name="knee" type="revolute"><parent link="hip"/><child link="shin"/>
 <origin xyz="0 0 -0.3" rpy="0 0 0"/><axis xyz="0 1 0"/>
 <limit lower="-1" upper="1" effort="5" velocity="2"/><dynamics damping="0.1" friction="0.2"/>
 <mimic joint="sole" multiplier="2" offset="0.1"/></joint>
<link name="foot"><inertial><mass value="1"/>
 <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="sole" type="continuous"><parent link="shin"/><child link="foot"/></joint>
</robot>)";

std::string Changed(const std::vector<std::pair<std::string, std::string>>& changes) {
  std::string text = kKneeUrdf;
  for (const auto& change : changes) {
    const std::size_t at = text.find(change.first);
    EXPECT_NE(std::string::npos, at) << change.first;
    text.replace(at, change.first.size(), change.second);
  }
  return text;
}
RobotModel ParseText(const std::string& text, UrdfFaults faults = UrdfFaults::kLenient) {
  return ParseUrdf(text, RobotBase::kFloating, faults);
}
/// The warnings that the text as it is does not have.
std::vector<std::string> NewWarnings(const std::string& text) {
  const std::vector<std::string> usual = ParseText(kKneeUrdf).warnings;
  std::vector<std::string> fresh;
  for (const std::string& warning : ParseText(text).warnings) {
    const bool known = std::find(usual.begin(), usual.end(), warning) != usual.end();
    const bool shorter = warning.find("where 'joints' asks for them") != std::string::npos;
    if (!known && !shorter) fresh.push_back(warning);
  }
  return fresh;
}

TEST(UrdfSpelling, IsToldInOneLineEachAndRefusedWhereStrict) {
  EXPECT_EQ("", test::RefusalOf([] { ParseText(kKneeUrdf, UrdfFaults::kStrict); }));
  const struct {
    std::vector<std::pair<std::string, std::string>> changes;
    const char* told;
  } cases[] = {
      {{{"<inertial><origin", "<inertail><origin"},
        {"iyz=\"0\"/></inertial>\n <coll", "iyz=\"0\"/></inertail>\n <coll"}},
       "link 'shin': unknown tag 'inertail'; did you mean 'inertial'? (line 4)"},
      {{{"<collision name", "<colision name"}, {"</collision>", "</colision>"}},
       "link 'shin': unknown tag 'colision'; did you mean 'collision'? (line 6)"},
      {{{"name=\"c\"", "nam=\"c\""}},
       "link 'shin': <collision>: unknown attribute 'nam'; did you mean 'name'? (line 6)"},
      {{{"scale=", "scal="}},
       "link 'shin': <mesh>: unknown attribute 'scal'; did you mean 'scale'? (line 6)"},
      {{{"<axis xyz", "<axes xyz"}},
       "joint 'knee': unknown tag 'axes'; did you mean 'axis'? (line 9)"},
      {{{"xyz=\"0 0 -0.3\"", "xzy=\"0 0 -0.3\""}},
       "joint 'knee': <origin>: unknown attribute 'xzy'; did you mean 'xyz'? (line 9)"},
      {{{"<origin xyz=\"0 0 -0.1\"/>", "<orgin xyz=\"0 0 -0.1\"/>"}},
       "link 'shin': <inertial>: unknown tag 'orgin'; did you mean 'origin'? (line 4)"},
      {{{"lower=", "lowr="}},
       "joint 'knee': <limit>: unknown attribute 'lowr'; did you mean 'lower'? (line 10)"},
      {{{"<dynamics", "<dynamic"}},
       "joint 'knee': unknown tag 'dynamic'; did you mean 'dynamics'? (line 10)"},
      {{{"damping=", "dampng="}},
       "joint 'knee': <dynamics>: unknown attribute 'dampng'; did you mean 'damping'? (line 10)"},
      {{{"multiplier=", "multiplyer="}},
       "joint 'knee': <mimic>: unknown attribute 'multiplyer'; did you mean 'multiplier'? "
       "(line 11)"},
      {{{"<collision name", "<origin/><collision name"}},
       "link 'shin': <origin> is read within <joint>, <inertial>, <collision> alone (line 6)"},
  };
  for (const auto& c : cases) {
    const std::string text = Changed(c.changes);
    EXPECT_EQ(std::vector<std::string>{c.told}, NewWarnings(text));
    const std::string strict = test::RefusalOf([&] { ParseText(text, UrdfFaults::kStrict); });
    EXPECT_NE(std::string::npos, strict.find(c.told)) << strict;
  }
}

/// Where a part is missed, the name that may be it is told with the refusal, at its own line.
TEST(UrdfSpelling, StandsBesideWhatIsMissed) {
  const struct {
    std::vector<std::pair<std::string, std::string>> changes;
    const char *missed, *told;
  } cases[] = {
      {{{"<mass value=\"1\"/>", "<massx value=\"1\"/>"}},
       "mass element",
       "link 'shin': <inertial>: unknown tag 'massx'; did you mean 'mass'? (line 4)"},
      {{{"<mass value=\"1\"/>", "<mass valeu=\"1\"/>"}},
       "mass element",
       "link 'shin': <mass>: unknown attribute 'valeu'; did you mean 'value'? (line 4)"},
      {{{" <inertia ixx", " <inertia xix"}},
       "missing ixx",
       "link 'hip': <inertia>: unknown attribute 'xix'; did you mean 'ixx'? (line 3)"},
      {{{"<child link=\"foot\"/>", "<chidl link=\"foot\"/>"}},
       "[sole] is missing a parent and/or child",
       "joint 'sole': unknown tag 'chidl'; did you mean 'child'? (line 14)"},
      {{{"<axis xyz", "<axis xzy"}},
       "joint 'knee': its axis has no direction (line 8)",
       "joint 'knee': <axis>: unknown attribute 'xzy'; did you mean 'xyz'? (line 9)"},
      {{{"<joint name=\"sole\"", "<joitn name=\"sole\""},
        {"</joint>\n</robot>", "</joitn>\n</robot>"}},
       "Two root links found",
       "robot: unknown tag 'joitn'; did you mean 'joint'? (line 14)"},
      {{{"<link name=\"foot\"", "<likn name=\"foot\""},
        {"</link>\n<joint name=\"sole", "</likn>\n<joint name=\"sole"}},
       "child link [foot] of joint [sole] not found",
       "robot: unknown tag 'likn'; did you mean 'link'? (line 12)"},
  };
  for (const auto& c : cases) {
    const std::string refusal = test::RefusalOf([&] { ParseText(Changed(c.changes)); });
    EXPECT_NE(std::string::npos, refusal.find(c.missed)) << refusal;
    EXPECT_NE(std::string::npos, refusal.find(c.told)) << refusal;
  }
}

/// What is the same in many places is told once.
TEST(UrdfSpelling, IsCounted) {
  std::string text = kKneeUrdf;
  for (std::size_t at = 0; (at = text.find("izz=", at)) != std::string::npos; at += 9) {
    text.insert(at, "ixi=\"0\" ");
  }
  EXPECT_EQ(
      std::vector<std::string>{
          "link 'hip': <inertia>: unknown attribute 'ixi'; did you mean 'ixx'? (line 3); "
          "the same in 2 more places"},
      NewWarnings(text));
}

TEST(UrdfSpelling, LeavesWhatOthersReadInPeace) {
  const std::string text = Changed({
      {"<link name=\"hip\">",
       "<link name=\"hip\" type=\"t\"><visual><geometrie/><orign xzy=\"\"/></visual><material/>"
       "<gazebo/><sensor/><self_collision_checking/><contact><lateral_friction/></contact>"
       "<drake:proximity/><verbose value=\"V\"/>"},
      {"<collision name=\"c\">", "<collision name=\"c\" drake:a=\"b\"><verbose/><max_contacts/>"},
      {"<axis xyz", "<safety_controller k=\"1\"/><calibration/><transmission/><axis rpy=\"\" xyz"},
      {"<limit ", "<limit drake:acceleration=\"3\" acceleration=\"3\" "},
      {"<dynamics ", "<dynamics armature=\"1\" "},
  });
  EXPECT_EQ(std::vector<std::string>(), NewWarnings(text));
  EXPECT_EQ("", test::RefusalOf([&] { ParseText(text, UrdfFaults::kStrict); }));
}

TEST(UrdfSpelling, OfOurOwnRobotsIsRight) {
  int robots = 0;
  for (const char* folder : {"", "/../../config/robots"}) {
    for (const auto& entry :
         std::filesystem::directory_iterator(std::string(CONTACT_FLOW_TEST_DATA) + folder)) {
      if (entry.path().extension() != ".urdf") continue;
      std::ostringstream text;
      text << std::ifstream(entry.path()).rdbuf();
      EXPECT_EQ(std::vector<std::string>(), FindUnknownNames(ReadXml(text.str()))) << entry.path();
      ++robots;
    }
  }
  EXPECT_GE(robots, 15);
}

/// A macro that nothing defines adds nothing within <visual>; at the root it may be half a robot.
TEST(UrdfSpelling, OfTagsThatXacroLeftDependsOnWhereTheyAre) {
  const std::string grey = "<visual><xacro:grey/></visual><visual><xacro:grey/></visual>";
  const std::string painted = Changed({{"<link name=\"hip\">", "<link name=\"hip\">" + grey}});
  const std::vector<std::string> told = {
      "passed over: 2 calls of xacro's macros in parts that are not read, the first <xacro:grey/> "
      "(line 2)"};
  EXPECT_EQ(told, NewWarnings(painted));
  const struct {
    const char *before, *after, *tag;
  } cases[] = {
      {"<link name=\"foot\">", "<xacro:sensors/><link name=\"foot\">",
       "<xacro:sensors/> (line 12)"},
      {"<link name=\"foot\">", "<link name=\"foot\"><xacro:iron/>", "<xacro:iron/> (line 12)"},
      {"<link name=\"foot\"><inertial>", "<link name=\"foot\"><inertial><xacro:iron/>",
       "<xacro:iron/> (line 12)"},
      {"<axis ", "<xacro:stops/><axis ", "<xacro:stops/> (line 9)"},
  };
  for (const auto& c : cases) {
    const std::string refusal = test::RefusalOf([&] { ParseText(Changed({{c.before, c.after}})); });
    EXPECT_NE(std::string::npos, refusal.find(std::string(c.tag) + " calls a macro")) << refusal;
    EXPECT_NE(std::string::npos, refusal.find("delete the tag")) << refusal;
  }
  const std::string program =
      Changed({{"<link name=\"foot\">", "<xacro:property name=\"a\"/><link name=\"foot\">"}});
  const std::string refusal = test::RefusalOf([&] { ParseText(program); });
  EXPECT_NE(std::string::npos, refusal.find("run xacro on it first")) << refusal;
}

}  // namespace
}  // namespace contact_flow
