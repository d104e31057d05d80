// SPDX-License-Identifier: BSD-3-Clause
// What would make a robot without contacts, or with numbers that nothing uses, is told or refused;
// and meshes are read once.
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

#include "src/io/contact_meshes.h"
#include "src/io/xacro.h"
#include "test/io/contact_robots.h"

namespace contact_flow {
namespace {

using test::Collision;
using test::GeometryRefusal;
using test::Parse;
using test::UnitLink;
using test::Warns;

std::string BallLink() { return UnitLink("a", Collision("<sphere radius=\"0.1\"/>")); }
std::string MeshLink(const std::string& name, const std::string& mesh) {
  return UnitLink(name, Collision("<mesh filename=\"" + mesh + "\"/>"));
}
void ExpectSays(const std::string& answer, const std::string& words) {
  EXPECT_NE(std::string::npos, answer.find(words)) << "\"" << answer << "\" lacks " << words;
}

TEST(Silence, OfContactsThatAreAskedForAndNotMadeIsBroken) {
  const struct {
    const char *yaml, *words;
  } cases[] = {
      {"{base: floating, contacts: {ground: []}}", "contacts/ground is an empty list (line 1)"},
      {"{base: floating, terrain: {}}", "terrain holds no surface"},
      {"{base: floating, terrain: {}, contacts: {ground: all}}", "terrain holds no surface"},
      {"{base: floating, terrain: {f: {kind: plane}}, contacts: {ground: all, height: 0.5}}",
       "contacts/height is given beside a terrain"},
  };
  for (const auto& c : cases) ExpectSays(GeometryRefusal(BallLink(), c.yaml), c.words);
  // A height of zero says nothing; a terrain that is not given is the plane.
  const char* const right[] = {
      "{base: floating, terrain: {f: {kind: plane}}, contacts: {ground: all, height: 0}}",
      "{base: floating, terrain: , contacts: {ground: all, height: 0.5}}"};
  for (const char* yaml : right) EXPECT_EQ(1u, Parse(BallLink(), yaml).constraints.size()) << yaml;
  // None are none where that is asked for.
  const RobotDescription none = Parse(BallLink(), "{base: floating, contacts: {ground: none}}");
  EXPECT_FALSE(Warns(none, "NO CONTACTS"));
}

TEST(Silence, OfMissingMeshesNamesThemAndWhatToDo) {
  const std::string one = MeshLink("a", "package://my_robot/a.stl");
  const char* const yamls[] = {"base: floating", "{base: floating, contacts: {ground: all}}",
                               "{base: floating, contacts: {ground: feet}}"};
  for (const char* yaml : yamls) {
    const RobotDescription robot = Parse(one, yaml);
    EXPECT_EQ(0u, robot.constraints.size());
    ASSERT_EQ(1u, robot.model.warnings.size()) << yaml;
    for (const char* words : {"NO CONTACTS: this robot falls through everything", "link 'a'",
                              "'package://my_robot/a.stl' is not found", "ROS_PACKAGE_PATH"}) {
      ExpectSays(robot.model.warnings[0], words);
    }
  }
  const RobotDescription two =
      Parse(one + MeshLink("b", "b.stl") +
                "<joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/>"
                "</joint>",
            "base: floating", "/somewhere/");
  EXPECT_TRUE(Warns(two, "and 1 more below"));
  EXPECT_TRUE(Warns(two,
                    "link 'b' (line 1 of the URDF): its mesh 'b.stl' is not found in "
                    "/somewhere/: it is sought beside the URDF"));
  // A link that is fixed to the world has nothing to touch.
  const RobotDescription fixed = Parse(BallLink() + UnitLink("b", "") +
                                           "<joint name=\"j\" type=\"continuous\"><parent "
                                           "link=\"a\"/><child link=\"b\"/></joint>",
                                       "{base: fixed, contacts: {ground: [a]}}");
  EXPECT_TRUE(Warns(fixed, "NO CONTACTS: contacts/ground makes none"));
  EXPECT_TRUE(Warns(fixed, "link 'a' does not move"));
}

/// Counts how often a file is opened.
class Openings {
 public:
  explicit Openings(const std::string& path) : fd_(::inotify_init1(IN_NONBLOCK)) {
    EXPECT_GE(::inotify_add_watch(fd_, path.c_str(), IN_OPEN), 0);
  }
  ~Openings() { ::close(fd_); }
  int Count() {
    int count = 0;
    alignas(inotify_event) char buffer[4096];
    for (ssize_t n; (n = ::read(fd_, buffer, sizeof buffer)) > 0;) {
      for (const char* at = buffer; at < buffer + n;) {
        const auto* event = reinterpret_cast<const inotify_event*>(at);
        count += (event->mask & IN_OPEN) != 0;
        at += sizeof(inotify_event) + event->len;
      }
    }
    return count;
  }

 private:
  const int fd_;
};

class SilentFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::TempDir() + "contact_flow_silence_";
    std::ofstream stl(folder_ + "tetra.stl");
    stl << "solid t\n";
    const char* const corners[] = {"0 0 0", "1 0 0", "0 1 0", "0 0 1"};
    for (int missed = 0; missed < 4; ++missed) {
      for (int k = 0; k < 4; ++k) {
        if (k != missed) stl << "vertex " << corners[k] << "\n";
      }
    }
  }
  void TearDown() override {
    for (const char* name : {"tetra.stl", "r.urdf", "r.yaml"}) {
      std::remove((folder_ + name).c_str());
    }
  }
  /// Links in a star, each with the same mesh, and its YAML.
  void WriteStar(int links, const std::string& yaml) {
    const std::string mesh = "file://" + folder_ + "tetra.stl";
    std::string text = MeshLink("l0", mesh);
    for (int k = 1; k < links; ++k) {
      const std::string name = "l" + std::to_string(k);
      text += MeshLink(name, mesh) + "<joint name=\"j" + std::to_string(k) +
              "\" type=\"continuous\"><parent link=\"l0\"/><child link=\"" + name +
              "\"/><origin xyz=\"0 0 " + std::to_string(k) + "\"/></joint>";
    }
    std::ofstream(folder_ + "r.urdf") << test::UnboundRobot(text);
    std::ofstream(folder_ + "r.yaml") << "urdf: " << folder_ << "r.urdf\n" << yaml;
  }
  std::string folder_;
};

TEST_F(SilentFiles, AreReadOnceHoweverOftenContactsAreTried) {
  for (const int links : {1, 3, 40}) {  // 160 corners are too many: three ways are tried
    WriteStar(links, "base: floating\n");
    Openings openings(folder_ + "tetra.stl");
    const RobotDescription robot = ParseRobot(ReadRobotTexts(folder_ + "r.yaml"));
    EXPECT_FALSE(robot.constraints.empty());
    EXPECT_EQ(1, openings.Count()) << links;
  }
}

/// A mesh that holds nothing is told of by the texts alone.
TEST_F(SilentFiles, AreReadOnceWhereTheyMakeNothing) {
  WriteStar(2, "base: floating\n");
  std::ofstream(folder_ + "tetra.stl") << "solid nothing\n";
  Openings openings(folder_ + "tetra.stl");
  const RobotDescription robot = ParseRobot(ReadRobotTexts(folder_ + "r.yaml"));
  EXPECT_EQ(1, openings.Count());
  EXPECT_TRUE(Warns(robot, "NO CONTACTS"));
  EXPECT_TRUE(Warns(robot, "there are no vertices"));
}

TEST_F(SilentFiles, ShareCornersOnlyOnce) {
  ContactMeshes meshes(folder_.substr(0, folder_.rfind('/') + 1));
  const ContactMeshes::Mesh& mesh = meshes.Take("file://" + folder_ + "tetra.stl");
  EXPECT_EQ("", mesh.wrong);
  EXPECT_EQ(4u, mesh.vertices.size());
  EXPECT_EQ(&mesh, &meshes.Take("contact_flow_silence_tetra.stl"));
}

/// What xacro left over is no program for it.
TEST_F(SilentFiles, WithLeftOverCallsOfMacrosAreNoXacro) {
  EXPECT_FALSE(IsXacro("a.urdf", "<robot><link><visual><xacro:grey/></visual></link></robot>"));
  EXPECT_FALSE(IsXacro("a.urdf", "<robot><gazebo><xacro:plugin/></gazebo></robot>"));
  EXPECT_FALSE(IsXacro("a.urdf", "<robot><xacro:sensors/></robot>"));
  EXPECT_TRUE(IsXacro("a.urdf", "<robot><xacro:macro name=\"leg\"/><xacro:leg/></robot>"));
  EXPECT_TRUE(IsXacro("a.urdf", "<robot><xacro:if value=\"1\"><link/></xacro:if></robot>"));
  EXPECT_TRUE(IsXacro("a.urdf", "<robot><link><visual><xacro:property/></visual></link></robot>"));
  const std::string grey =
      UnitLink("a", Collision("<sphere radius=\"0.1\"/>") + "<visual><xacro:grey/></visual>");
  std::ofstream(folder_ + "r.urdf") << test::UnboundRobot(grey);
  const RobotDescription robot =
      ParseRobot(ReadUrdf(folder_ + "r.urdf").urdf, YAML::Load("base: floating"));
  EXPECT_EQ(1u, robot.constraints.size());
  EXPECT_TRUE(Warns(robot, "the first <xacro:grey/> (line 1)"));
}

TEST(Silence, OfNumbersThatNothingUsesIsBroken) {
  const auto legged = [](const std::string& dynamics) {
    return BallLink() + UnitLink("b", "") +
           "<joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/>" +
           dynamics + "</joint>";
  };
  const std::string plain = legged("");
  const struct {
    std::string urdf;
    const char *yaml, *words;
  } cases[] = {
      {plain, "{inputs: [u, u]}", "inputs names 'u' twice (line 1)"},
      {plain, "{efforts: {s: {kind: servo, joint: j, input: 0.3, stiffness: 1}}}",
       "s/input is '0.3', expected the name of an input"},
      {plain, "{efforts: {s: {kind: actuator, joint: j, input: u, gear: 0}}}",
       "s/gear is 0, so that its input would do nothing (line 1)"},
      {plain, "{soles: {b: {stiffness: 1, mass: 1}}}",
       "soles/b: link 'b' has no <collision> in the URDF that the sole could take"},
      {legged("<dynamics damping=\"-0.1\"/>"), "{joints: {damping: all}}",
       "joints/damping: the URDF gives joint 'j' the damping -0.1, which would drive it"},
      {legged("<dynamics damping=\"-0.1\"/>"), "{joints: {damping: [j]}}", "which would drive it"},
      {legged("<dynamics friction=\"-2\"/>"), "{joints: {friction: all}}",
       "the URDF gives joint 'j' the friction -2"},
      {plain,
       "{constraints: {c: {kind: stairs, link: b, rise: 0.1, run: 0.3, riser: 0.02, first: 3, "
       "last: 1}}}",
       "c/last is 1, not beyond first, 3: no step would rise"},
  };
  for (const auto& c : cases) ExpectSays(GeometryRefusal(c.urdf, c.yaml), c.words);
  // A sole that constraints name may be without geometry, damping that nobody asks for negative.
  EXPECT_EQ("", GeometryRefusal(plain,
                                "{soles: {b: {stiffness: 1, mass: 1}}, constraints: {c: {kind: "
                                "plane, link: b_sole}}}"));
  EXPECT_EQ("",
            GeometryRefusal(legged("<dynamics damping=\"-0.1\"/>"), "{joints: {friction: all}}"));
  EXPECT_EQ("", GeometryRefusal(plain,
                                "{inputs: [u], efforts: {s: {kind: servo, joint: j, input: "
                                "u, stiffness: 1}}}"));
}

}  // namespace
}  // namespace contact_flow
