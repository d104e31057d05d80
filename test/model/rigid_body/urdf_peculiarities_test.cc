// SPDX-License-Identifier: BSD-3-Clause
// What public URDFs do beside the letter: one test each, against numbers computed by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/model/rigid_body/kinematics.h"
#include "contact_flow/model/rigid_body/mass_matrix.h"
#include "contact_flow/model/rigid_body/urdf_loader.h"
#include "test/refusal.h"

namespace contact_flow {
namespace {

std::string Inertia(double mass, double ixx, double iyy, double izz, double x = 0) {
  const auto text = [](double number) { return "\"" + std::to_string(number) + "\""; };
  return "<inertial><origin xyz=\"" + std::to_string(x) + " 0 0\"/><mass value=" + text(mass) +
         "/><inertia ixx=" + text(ixx) + " iyy=" + text(iyy) + " izz=" + text(izz) +
         " ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";
}
std::string Link(const std::string& name, const std::string& content) {
  return "<link name=\"" + name + "\">" + content + "</link>\n";
}
std::string ZJoint(const std::string& name, const std::string& type, const std::string& parent,
                   const std::string& child, const std::string& content = "") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/><axis xyz=\"0 0 1\"/>" + content + "</joint>\n";
}
std::string Robot(const std::string& content) {
  return "<robot name=\"r\">\n" + content + "</robot>";
}
RobotModel Parse(const std::string& content, UrdfFaults faults = UrdfFaults::kLenient) {
  return ParseUrdf(Robot(content), RobotBase::kFixed, faults);
}
std::string Refusal(const std::string& content, UrdfFaults faults = UrdfFaults::kLenient) {
  return test::RefusalOf([&] { Parse(content, faults); });
}
void ExpectWarning(const RobotModel& robot, const std::string& words) {
  for (const std::string& warning : robot.warnings) {
    if (warning.find(words) != std::string::npos) return;
  }
  ADD_FAILURE() << "no warning says: " << words << " of " << robot.warnings.size();
}
void ExpectRefusal(const std::string& answer, const std::string& words) {
  EXPECT_NE(std::string::npos, answer.find(words)) << "\"" << answer << "\" lacks " << words;
}

/// M of a robot of one freedom at zero.
double Mass(const RobotModel& robot) {
  TreeState<double> state(robot.tree);
  UpdatePositions(robot.tree, robot.tree.Neutral().data(), &state);
  UpdateInertias(robot.tree, &state);
  Matrix mass(robot.tree.dof(), robot.tree.dof());
  MassMatrix(robot.tree, &state, mass.data());
  return mass(0, 0);
}

const char kWorld[] = "<link name=\"world\"/>\n";

TEST(UrdfPeculiarities, LinksWithoutMassJoinWhatTheyAreFixedTo) {
  const std::string zero =
      "<inertial><mass value=\"0\"/><inertia ixx=\"0\" iyy=\"0\" izz=\"0\" "
      "ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";
  const std::string arm =
      kWorld + Link("arm", "") + Link("frame", zero) + Link("tip", Inertia(2, 0, 0, 0)) +
      ZJoint("j", "continuous", "world", "arm") + ZJoint("f", "fixed", "arm", "frame") +
      ZJoint("g", "fixed", "frame", "tip", "<origin xyz=\"0.5 0 0\"/>");
  EXPECT_NEAR(2 * 0.5 * 0.5, Mass(Parse(arm)), 1e-15);  // m r² of a point
  ExpectRefusal(Refusal(arm, UrdfFaults::kStrict), "link 'frame': its mass is 0");
}

/// Frames often have mass 0 and a placeholder for an inertia, which other programs
/// take for nothing.
TEST(UrdfPeculiarities, InertiaWithoutMassIsNotUsed) {
  const RobotModel both = Parse(
      kWorld + Link("link", Inertia(3, 0, 0, 0.1)) + Link("grasp", Inertia(0, 0.1, 0.1, 0.1)) +
      ZJoint("j", "continuous", "world", "link") + ZJoint("f", "fixed", "link", "grasp"));
  EXPECT_NEAR(0.1, Mass(both), 1e-15);
  ExpectWarning(both, "link 'grasp': its mass is 0, so that its inertia is not used");
}

/// S = ½ tr(I) 1 − I has the eigenvalues 0.021, 0, −0.001; without the last one I is diag(0, 21,
/// 21) g m².
TEST(UrdfPeculiarities, ASlightlyIndefiniteInertiaIsReplacedByTheNearest) {
  const std::string robot = kWorld + Link("a", Inertia(1, -0.001, 0.020, 0.021)) +
                            ZJoint("j", "continuous", "world", "a");
  const RobotModel repaired = Parse(robot);
  const Mat3<double> inertia = repaired.FindLink("a").inertia.central;
  EXPECT_LE((inertia - Mat3<double>(Vec3<double>(0, 0.021, 0.021).asDiagonal())).norm(), 1e-12);
  ExpectWarning(repaired, "link 'a': its inertia is not positive definite");
  ExpectRefusal(Refusal(robot, UrdfFaults::kStrict), "link 'a'");
  // Off by more than a tenth it is a mistake.
  ExpectRefusal(Refusal(kWorld + Link("a", Inertia(1, -0.01, 0.020, 0.021)) +
                        ZJoint("j", "continuous", "world", "a")),
                "link 'a': its inertia is not positive definite");
  // What is fixed to the world is not judged.
  EXPECT_EQ("", Refusal(Link("world", Inertia(1, -1, 1, 1)) + Link("a", Inertia(1, 1, 1, 1)) +
                        ZJoint("j", "continuous", "world", "a")));
}

TEST(UrdfPeculiarities, AnInertiaOfNoBodyIsUsedWithAWarning) {
  const std::string robot =
      kWorld + Link("a", Inertia(1, 1, 1, 3)) + ZJoint("j", "continuous", "world", "a");
  const RobotModel used = Parse(robot);
  EXPECT_EQ(3, Mass(used));
  ExpectWarning(used, "link 'a': no body has its inertia");
  ExpectRefusal(Refusal(robot, UrdfFaults::kStrict), "link 'a': no body has its inertia");
}

/// The joined body counts: 1 kg half a metre off adds 0.25 kg m² across.
TEST(UrdfPeculiarities, InertiaIsJudgedOnTheJoinedBody) {
  const std::string robot = kWorld + Link("a", Inertia(1, 1, 1, 1)) +
                            Link("sensor", Inertia(0.001, 1e-6, 1e-6, 3e-6)) +
                            ZJoint("j", "continuous", "world", "a") +
                            ZJoint("f", "fixed", "a", "sensor", "<origin xyz=\"0.5 0 0\"/>");
  EXPECT_TRUE(Parse(robot).warnings.empty());
  EXPECT_EQ("", Refusal(robot, UrdfFaults::kStrict));
}

TEST(UrdfPeculiarities, JointsThatMoveNoMassAreHeld) {
  const std::string plain =
      kWorld + Link("a", Inertia(1, 1, 1, 1, 0.3)) + ZJoint("j", "continuous", "world", "a");
  const std::string more =
      Link("camera", "") + Link("lens", "") + Link("dot", Inertia(1, 0, 0, 0)) +
      ZJoint("pan", "continuous", "a", "camera") + ZJoint("zoom", "continuous", "camera", "lens") +
      ZJoint("spin", "continuous", "a", "dot");
  const RobotModel robot = Parse(plain + more);
  EXPECT_EQ(std::vector<std::string>{"j"}, robot.coordinates);
  EXPECT_EQ(3u, robot.held.size());
  EXPECT_NEAR(1 + 0.09, Mass(robot), 1e-15);  // the point on the axis adds nothing
  ExpectWarning(robot, "move no mass and are held at zero");
  ExpectRefusal(Refusal(plain + more, UrdfFaults::kStrict), "moves no mass");
  try {
    robot.FindCoordinate("pan");
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    ExpectRefusal(error.what(), "joint 'pan' moves no mass and is held at zero");
  }
}

TEST(UrdfPeculiarities, WhatIsNotReadMayBeWrong) {
  const RobotModel robot = Parse(
      kWorld +
      Link("a", Inertia(1, 1, 1, 1) + "<visual><geometry><plane/></geometry><material/>"
                                       "</visual>") +
      "<material/><transmission name=\"t\"><joint/></transmission><gazebo><link><link/></link>"
      "</gazebo><gazebo/>" +
      ZJoint("j", "revolute", "world", "a",
             "<limit lower=\"-1\" upper=\"2\" effort=\"3\" velocity=\"4\"/><safety_controller/>"
             "<dynamics damping=\"0.5\" friction=\"0.25\"/>"));
  ExpectWarning(robot, "passed over: 2 <gazebo>, 1 <transmission>");
  ASSERT_EQ(1u, robot.traits.size());
  const RobotModel::JointTraits& joint = robot.traits[0];
  EXPECT_TRUE(joint.limited);
  EXPECT_EQ(-1, joint.lower);
  EXPECT_EQ(2, joint.upper);
  EXPECT_EQ(3, joint.effort);
  EXPECT_EQ(4, joint.speed);
  EXPECT_EQ(0.5, joint.damping);
  EXPECT_EQ(0.25, joint.friction);
}

TEST(UrdfPeculiarities, CollisionsOfAllKindsAreRead) {
  const auto collision = [](const std::string& geometry) {
    return "<collision><origin xyz=\"1 2 3\" rpy=\"0 0 1.5707963267948966\"/><geometry>" +
           geometry + "</geometry></collision>";
  };
  const RobotModel robot = Parse(
      kWorld + ZJoint("j", "continuous", "world", "a") +
      Link("a", Inertia(1, 1, 1, 1) + collision("<box size=\"1 2 3\"/>") +
                    collision("<sphere radius=\"4\"/>") +
                    collision("<cylinder radius=\"5\" length=\"6\"/>") +
                    collision("<capsule radius=\"7\" length=\"8\"/>") +
                    collision("<mesh filename=\"package://p/a&amp;b.stl\" scale=\"1 1 2\"/>") +
                    collision("<plane normal=\"0 0 1\"/>") + collision("<box size=\"1 2\"/>")));
  using Kind = RobotModel::Shape::Kind;
  ASSERT_EQ(5u, robot.shapes.size());
  EXPECT_EQ(Kind::kBox, robot.shapes[0].kind);
  EXPECT_EQ(Vec3<double>(1, 2, 3), robot.shapes[0].size);
  EXPECT_EQ(4, robot.shapes[1].size(0));
  EXPECT_EQ(6, robot.shapes[2].size(1));
  EXPECT_EQ(Kind::kCapsule, robot.shapes[3].kind);
  EXPECT_EQ("package://p/a&b.stl", robot.shapes[4].mesh);
  EXPECT_EQ(2, robot.shapes[4].size(2));
  // x of the shape is y of the link.
  EXPECT_LE((robot.shapes[0].pose * Vec3<double>(1, 0, 0) - Vec3<double>(1, 3, 3)).norm(), 1e-15);
  ExpectWarning(robot, "link 'a': a collision is passed over: its geometry 'plane'");
  ExpectWarning(robot, "the numbers of its box cannot be read");
}

TEST(UrdfPeculiarities, AllFindingsOfAFileComeTogetherWithTheirLines) {
  const std::string answer =
      Refusal(kWorld + Link("a", "<inertial><mass value=\"heavy\"/></inertial>") +
              Link("b", "<inertial><mass value=\"${mass}\"/></inertial>") +
              ZJoint("j", "continuous", "world", "a", "<origin xyz=\"0, 0, 1\"/>"));
  ExpectRefusal(answer, "3 findings");
  ExpectRefusal(answer, "link 'a': mass value=\"heavy\" is not a finite number (line 3)");
  ExpectRefusal(answer, "link 'b'");
  ExpectRefusal(answer, "this is xacro text; run xacro on the file first (line 4)");
  ExpectRefusal(answer, "joint 'j': origin xyz=\"0, 0, 1\" is not 3 finite numbers (line 5)");
  const std::string second =
      Refusal(kWorld + Link("a", Inertia(-1, 1, 1, 1)) + Link("b", Inertia(1, -1, 1, 1)) +
              ZJoint("j", "continuous", "world", "a", "<mimic joint=\"jj\"/>") +
              ZJoint("k", "continuous", "world", "b", "<mimic joint=\"k\"/>"));
  ExpectRefusal(second, "link 'a': its mass is -1");
  ExpectRefusal(Refusal("<xacro:macro name=\"leg\"/>" + Link("a", "")), "run xacro on it first");
}

TEST(UrdfPeculiarities, MimicJointsAreKeptWithTheirNumbers) {
  const std::string bodies = kWorld + Link("a", Inertia(1, 1, 1, 1)) +
                             Link("b", Inertia(1, 1, 1, 1)) +
                             ZJoint("j", "continuous", "world", "a");
  const auto k = [&](const std::string& mimic) {
    return bodies + ZJoint("k", "continuous", "world", "b", mimic);
  };
  const RobotModel robot = Parse(k("<mimic joint=\"j\" multiplier=\"-2\" offset=\"0.1\"/>"));
  ASSERT_EQ(1u, robot.mimics.size());
  EXPECT_EQ("j", robot.mimics[0].master);
  EXPECT_EQ(-2, robot.mimics[0].multiplier);
  EXPECT_EQ(0.1, robot.mimics[0].offset);
  ExpectRefusal(Refusal(k("<mimic joint=\"jj\"/>")),
                "joint 'k' mimics 'jj': unknown joint 'jj'; "
                "did you mean 'j'?");
  ExpectRefusal(Refusal(k("<mimic joint=\"k\"/>")), "joint 'k' mimics itself");
}

/// Spaces and line ends within the quotes of a value; an apostrophe in a comment is none.
TEST(UrdfPeculiarities, SpacesAroundValues) {
  std::string link = Link("b", Inertia(2, 0.1, 0.2, 0.25));
  link.replace(link.find("izz=\"0.25"), 5, "izz=\" \r\n ");
  link.replace(link.find("2.000000\""), 9, "2.000000\r\n\"");
  const RobotModel robot = Parse(Link("a", "") + "<!-- it's a link -->" + link +
                                 ZJoint("j", "continuous", "a", "b"));
  EXPECT_DOUBLE_EQ(0.25, Mass(robot));
  EXPECT_DOUBLE_EQ(2, robot.FindLink("b").inertia.mass);
}

/// Where J_x and J_y of a planar joint go, as docs/conventions.md says.
/// A robot without a name, a slide without <limit>, and limits without effort or velocity.
TEST(UrdfPeculiarities, LimitsAndNamesMayLack) {
  std::string slide = Link("base", "") + Link("cart", Inertia(2, 1, 1, 1)) +
                      ZJoint("x", "prismatic", "base", "cart");
  slide.pop_back();  // </joint></robot>
  const RobotModel unnamed =
      ParseUrdf("<robot>\n" + slide + "</robot>", RobotBase::kFixed, UrdfFaults::kLenient);
  EXPECT_EQ("robot", unnamed.name);
  EXPECT_EQ(2, Mass(unnamed));
  ExpectWarning(unnamed, "the robot has no name: 'robot' is used (line 1)");
  ExpectWarning(unnamed, "joint 'x' has no <limit>: it moves without stops (line 4)");
  const RobotModel half = Parse(
      Link("base", "") + Link("arm", Inertia(2, 1, 1, 3)) +
      ZJoint("turn", "revolute", "base", "arm", "\n<limit lower='-1' upper='1' velocity='2'/>"));
  EXPECT_EQ(3, Mass(half));
  ExpectWarning(half, "joint 'turn': its <limit> has no effort, which nothing uses (line 5)");
  const std::string none = Link("base", "") + Link("arm", Inertia(2, 1, 1, 3)) +
                           ZJoint("turn", "revolute", "base", "arm", "<limit lower='-1'/>");
  ExpectWarning(Parse(none), "its <limit> has no effort and no velocity");
  ExpectRefusal(Refusal(none, UrdfFaults::kStrict), "has no effort and no velocity");
}

/// Some simulators know a link 'world' that no file defines.
TEST(UrdfPeculiarities, TheWorldMayLack) {
  const std::string hung =
      Link("cart", Inertia(2, 1, 1, 1)) +
      ZJoint("x", "prismatic", "world", "cart", "<limit effort='1' velocity='1'/>");
  const RobotModel robot = Parse(hung);
  EXPECT_EQ(2, Mass(robot));
  ExpectWarning(robot, "joints hang on a link 'world' that is not there: it is added");
  ExpectRefusal(Refusal(hung, UrdfFaults::kStrict), "'world'");
}

TEST(UrdfPeculiarities, PlanarJointsHaveTheirDirections) {
  const struct {
    const char* axis;
    Vec3<double> x, y;
  } cases[] = {{"0 0 1", {1, 0, 0}, {0, 1, 0}},
               {"0 2 0", {1, 0, 0}, {0, 0, -1}},
               {"1 0 0", {0, 1, 0}, {0, 0, 1}}};
  for (const auto& c : cases) {
    const RobotModel robot =
        Parse(Link("a", "") + Link("b", Inertia(2, 0.1, 0.2, 0.25)) +
              "<joint name=\"j\" type=\"planar\"><parent link=\"a\"/><child link=\"b\"/><axis "
              "xyz=\"" + c.axis + "\"/></joint>");
    ASSERT_EQ((std::vector<std::string>{"j_x", "j_y", "j_angle"}), robot.coordinates);
    TreeState<double> state(robot.tree);
    const RobotModel::Link& link = robot.FindLink("b");
    for (int k = 0; k < 2; ++k) {
      UpdatePositions(robot.tree, Vector::Unit(3, k).eval().data(), &state);
      const Vec3<double> at = PointPosition(state, link.body, link.pose.position);
      EXPECT_TRUE(at.isApprox(k == 0 ? c.x : c.y, 1e-12)) << c.axis;
    }
  }
}

/// Joints that mimic one another have nobody to follow.
TEST(UrdfPeculiarities, MimicsInARingAreRefused) {
  const auto follows = [](const char* master) {
    return std::string("<mimic joint=\"") + master + "\"/>";
  };
  const std::string answer =
      Refusal(Link("a", "") + Link("b", Inertia(2, 0.1, 0.2, 0.25)) +
              Link("c", Inertia(2, 0.1, 0.2, 0.25)) +
              ZJoint("j", "continuous", "a", "b", follows("k")) +
              ZJoint("k", "continuous", "b", "c", follows("j")));
  ExpectRefusal(answer, "joint 'j' mimics itself by way of 'k'");
  ExpectRefusal(answer, "leave out the <mimic>");
}

TEST(UrdfPeculiarities, ShapeWithoutMassIsRefusedInAWord) {
  ExpectRefusal(Refusal(kWorld + Link("a", "") + ZJoint("j", "continuous", "world", "a")),
                "move no mass");
  const std::string text =
      Robot(Link("a", "") + Link("b", "") + ZJoint("j", "continuous", "a", "b"));
  try {
    ParseUrdf(text, RobotBase::kFloating);
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    ExpectRefusal(error.what(), "what moves has no mass");
  }
  // A root without mass that floats moves as the joint on it does.
  try {
    ParseUrdf(
        Robot(Link("a", "") + Link("b", Inertia(1, 1, 1, 1)) + ZJoint("j", "continuous", "a", "b")),
        RobotBase::kFloating);
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    ExpectRefusal(error.what(), "give the root link an <inertial>, or fix it (base: fixed)");
  }
}

}  // namespace
}  // namespace contact_flow
