// SPDX-License-Identifier: BSD-3-Clause
// Contacts from collision geometry, against the support functions of the shapes themselves.
#include "src/io/contacts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>

#include "contact_flow/io/robot_summary.h"
#include "test/io/contact_robots.h"

namespace contact_flow {
namespace {

using test::Collision;
using test::GeometryRefusal;
using test::LowestGap;
using test::Parse;
using test::Placed;
using test::UnitLink;
using test::Warns;

TEST(Contacts, OfSmoothShapesAreExact) {
  std::mt19937 generator(1);
  // Lowest point of each shape below its centre, by its support function along −z.
  using Depth = double (*)(const Mat3<double>&);
  const struct {
    const char* geometry;
    int count;
    Depth depth;
  } shapes[] = {
      {"<sphere radius=\"0.3\"/>", 1, [](const Mat3<double>&) { return 0.3; }},
      {"<box size=\"0.2 0.4 0.6\"/>", 8,
       [](const Mat3<double>& R) {
         return 0.1 * std::abs(R(2, 0)) + 0.2 * std::abs(R(2, 1)) + 0.3 * std::abs(R(2, 2));
       }},
      {"<capsule radius=\"0.1\" length=\"0.5\"/>", 2,
       [](const Mat3<double>& R) { return 0.25 * std::abs(R(2, 2)) + 0.1; }},
  };
  for (const auto& shape : shapes) {
    const RobotSystem system(
        Parse(UnitLink("a", Collision(shape.geometry)),
              "{base: floating, contacts: {ground: all, height: 0.25, restitution: 0.5}}"),
        {});
    EXPECT_EQ(shape.count, system.num_constraints());
    EXPECT_EQ(0.5, system.restitution()(0));
    for (int k = 0; k < 100; ++k) {
      const Placed placed(&generator);
      // Positions of a few metres are exact to 1e-15.
      EXPECT_NEAR(placed.centre(2) - shape.depth(placed.rotation) - 0.25,
                  LowestGap(system, placed.q), 2e-9)
          << shape.geometry;
    }
  }
}

/// A wheel: its lowest point is half the width along the axis, and the radius across it.
TEST(Contacts, OfAWheelAreItsRims) {
  const RobotSystem system(
      Parse(UnitLink("a", "") +
                UnitLink("wheel",
                         Collision("<cylinder radius=\"0.3\" length=\"0.1\"/>",
                                   "<origin xyz=\"0 0 0\" rpy=\"1.5707963267948966 0 0\"/>")) +
                "<joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"wheel\"/>"
                "<axis xyz=\"0 1 0\"/></joint>",
            "{base: floating, contacts: {ground: [wheel]}}"),
      {});
  ASSERT_EQ(2, system.num_constraints());
  std::mt19937 generator(2);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 100; ++k) {
    Vector q(8);
    for (int i = 0; i < 8; ++i) q(i) = normal(generator);
    q.segment<4>(3).normalize();
    const Eigen::Quaterniond body(q(3), q(4), q(5), q(6));
    const double along = (body * Vec3<double>(0, 1, 0))(2);
    EXPECT_NEAR(q(2) - 0.05 * std::abs(along) - 0.3 * std::sqrt(1 - along * along),
                LowestGap(system, q), 1e-8);  // YAML holds 1e-9
  }
}

/// The same over the surfaces of a terrain, which say their own restitution, beside a box; what
/// is made of the YAML leaves it as it is.
TEST(Contacts, OfAWheelOnATerrainAreItsRims) {
  const std::string urdf =
      UnitLink("a", Collision("<box size=\"0.2 0.2 0.2\"/>")) +
      UnitLink("wheel", Collision("<cylinder radius=\"0.3\" length=\"0.1\"/>",
                                  "<origin xyz=\"0 0 0\" rpy=\"1.5707963267948966 0 0\"/>")) +
      "<joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"wheel\"/>"
      "<axis xyz=\"0 1 0\"/></joint>";
  const std::string yaml =
      "{base: floating, contacts: {ground: all, restitution: 0.2}, terrain: {ramp: {kind: plane, "
      "normal: [-1, 0, 2], offset: -0.3, restitution: 0.5}, floor: {kind: plane}}, nominal: "
      "{velocities: {base_x: 1}}}";
  const YAML::Node document = YAML::Load(yaml);
  const RobotDescription robot = ParseRobot(test::UnboundRobot(urdf), document);
  EXPECT_FALSE(DescribeRobot(robot, document, "r.urdf", "").empty());
  EXPECT_EQ(YAML::Dump(YAML::Load(yaml)), YAML::Dump(document));
  const RobotSystem system(Parse(urdf, yaml), {});
  const auto& names = system.description().constraints;
  ASSERT_EQ(20u, names.size());
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 100; ++k) {
    Vector q(8);
    for (int i = 0; i < 8; ++i) q(i) = normal(generator);
    q.segment<4>(3).normalize();
    const Eigen::Quaterniond body(q(3), q(4), q(5), q(6));
    ConstraintTerms terms;
    system.Constraints(q, Vector::Zero(system.dof()), &terms);
    for (const bool ramp : {false, true}) {
      const Vec3<double> up = ramp ? Vec3<double>(Vec3<double>(-1, 0, 2) / std::sqrt(5.))
                                   : Vec3<double>(Vec3<double>::UnitZ());
      double lowest = HUGE_VAL;
      for (int i = 0; i < 20; ++i) {
        const std::string& name = names[static_cast<std::size_t>(i)];
        if ((name.find("_ramp") != std::string::npos) != ramp) continue;
        EXPECT_EQ(ramp ? 0.5 : 0.2, system.restitution()(i)) << name;
        if (name.find("wheel") == 0) lowest = std::min(lowest, terms.gap(i));
      }
      const double along = up.dot(body * Vec3<double>(0, 1, 0));
      EXPECT_NEAR(up.dot(q.head<3>()) + (ramp ? 0.3 : 0) - 0.05 * std::abs(along) -
                      0.3 * std::sqrt(1 - along * along),
                  lowest, 1e-8);
    }
  }
}

/// A rotor lies on its face: corners of its circles, which have a lowest point.
TEST(Contacts, OfARotorAreCorners) {
  const RobotSystem system(
      Parse(UnitLink("a", "") +
                UnitLink("rotor", Collision("<cylinder radius=\"0.128\" length=\"0.005\"/>")) +
                "<joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child "
                "link=\"rotor\"/><axis xyz=\"0 0 1\"/></joint>",
            "{base: floating, contacts: {ground: [rotor]}}"),
      {});
  EXPECT_EQ(12, system.num_constraints());
  EXPECT_NEAR(0.1, LowestGap(system, system.nominal().x.head(8)), 1e-8) << "the usual drop height";
}

/// Cylinders that are no wheels lie inside the true shape, by at most what is said.
TEST(Contacts, OfOtherCylindersLieInside) {
  std::mt19937 generator(3);
  for (const double length : {0.1, 1.0}) {
    const double radius = 0.2;
    const RobotSystem system(Parse(UnitLink("a", Collision("<cylinder radius=\"0.2\" length=\"" +
                                                           std::to_string(length) + "\"/>")),
                                   "{base: floating, contacts: {ground: all}}"),
                             {});
    const double error =
        length > 2 * radius ? (std::sqrt(2.) - 1) * radius : (1 - std::cos(M_PI / 6)) * radius;
    for (int k = 0; k < 200; ++k) {
      const Placed placed(&generator);
      const double along = placed.rotation(2, 2);
      const double exact =
          placed.centre(2) - 0.5 * length * std::abs(along) - radius * std::sqrt(1 - along * along);
      const double gap = LowestGap(system, placed.q);
      EXPECT_GE(gap, exact - 1e-8);
      EXPECT_LE(gap, exact + error + 1e-8);
    }
  }
}

const char kLegs[] = R"(
<joint name="h" type="continuous"><parent link="body"/><child link="thigh"/></joint>
<joint name="k" type="continuous"><parent link="thigh"/><child link="foot"/>
  <origin xyz="0 0 -0.5"/></joint>
<joint name="a" type="continuous"><parent link="body"/><child link="arm"/></joint>)";

std::string Walker() {
  const auto ball = [](double z) {
    return Collision("<sphere radius=\"0.05\"/>",
                     "<origin xyz=\"0 0 " + std::to_string(z) + "\"/>");
  };
  return UnitLink("body", ball(0)) + UnitLink("thigh", ball(-0.2)) + UnitLink("foot", ball(-0.4)) +
         UnitLink("arm", ball(0.3)) + kLegs;
}

TEST(Contacts, FeetAreTheLowestEnds) {
  const RobotDescription feet = Parse(Walker(), "{base: floating, contacts: {ground: feet}}");
  ASSERT_EQ(1u, feet.constraints.size());
  EXPECT_EQ("foot", feet.constraints[0]->parts.name);
  EXPECT_EQ(4u, Parse(Walker(), "{base: floating, contacts: {ground: all}}").constraints.size());
  EXPECT_EQ(
      2u, Parse(Walker(), "{base: floating, contacts: {ground: [arm, foot]}}").constraints.size());
  EXPECT_EQ(0u, Parse(Walker(), "{base: floating, contacts: {ground: none}}").constraints.size());
}

TEST(Contacts, AreMadeWhereNothingIsSaid) {
  const RobotDescription robot = Parse(Walker(), "base: floating");
  EXPECT_EQ(4u, robot.constraints.size());
  EXPECT_TRUE(Warns(robot, "neither `constraints` nor `contacts` is given: 4 contacts"));
  // The foot is 0.5 + 0.4 + 0.05 below the base: 0.1 m above the ground.
  EXPECT_NEAR(1.05, robot.nominal.x(2), 1e-9);
  EXPECT_EQ(2, Parse(Walker(), "{base: floating, nominal: {positions: {base_z: 2}}}").nominal.x(2));
  // The floating joint of a URDF is as good as `base: floating`.
  const RobotDescription own =
      Parse("<link name=\"world\"/>" + Walker() +
                "<joint name=\"free\" type=\"floating\"><parent link=\"world\"/><child "
                "link=\"body\"/></joint>",
            "base: fixed");
  EXPECT_EQ(4u, own.constraints.size());
  EXPECT_NEAR(1.05, own.nominal.x(2), 1e-9);
  // One that hangs in the world, or has contacts of its own, gets none.
  EXPECT_EQ(0u, Parse(Walker(), "base: fixed").constraints.size());
  EXPECT_EQ(1u, Parse(Walker(), "{base: floating, constraints: {c: {kind: plane, link: foot}}}")
                    .constraints.size());
  EXPECT_TRUE(Warns(Parse(UnitLink("a", ""), "base: floating"), "NO CONTACTS"));
}

TEST(Contacts, AreAddedToThoseOfTheFile) {
  EXPECT_EQ(2u, Parse(Walker(),
                      "{base: floating, contacts: {ground: feet}, "
                      "constraints: {c: {kind: plane, link: arm}}}")
                    .constraints.size());
  EXPECT_NE("", GeometryRefusal(Walker(),
                                "{base: floating, contacts: {ground: feet}, "
                                "constraints: {foot: {kind: plane, link: arm}}}"));
}

TEST(Contacts, AreFewerWhereThereAreTooMany) {
  std::string boxes = UnitLink("l0", Collision("<box size=\"1 1 1\"/>", ""));
  for (int k = 1; k < 17; ++k) {
    const std::string name = "l" + std::to_string(k);
    boxes += UnitLink(name, Collision("<box size=\"1 1 1\"/>", "")) + "<joint name=\"j" +
             std::to_string(k) + "\" type=\"continuous\"><parent link=\"l0\"/><child link=\"" +
             name + "\"/><origin xyz=\"0 0 " + std::to_string(k == 1 ? 1 : 3) + "\"/></joint>";
  }
  const RobotDescription robot = Parse(boxes, "base: floating");
  EXPECT_TRUE(Warns(robot, "of the feet (of all links there were too many)"));
  EXPECT_EQ(4u, robot.constraints.size());  // the lower face of the lowest end
  for (const char* asked : {"{base: floating, contacts: {ground: all}}",
                            "{base: floating, contacts: {ground: all, friction: 1}}"}) {
    EXPECT_EQ(136u, Parse(boxes, asked).constraints.size()) << "all that are asked for";
  }
}

/// Distances from planes by their normal form, n = (−1, 0, 2)/√5 for a ramp of slope ½.
TEST(Contacts, AreMadeWithEverySurfaceOfATerrain) {
  const std::string terrain =
      "{floor: {kind: plane}, ramp: {kind: plane, normal: [-1, 0, 2], offset: -0.3}}";
  const RobotSystem system(
      Parse(Walker(), "{base: floating, contacts: {ground: [foot]}, terrain: " + terrain + "}"),
      {});
  ASSERT_EQ((std::vector<std::string>{"foot_floor", "foot_ramp"}),
            system.description().constraints);
  Vector q = system.robot().model.tree.Neutral();
  q(0) = 0.7;
  q(2) = 2;
  ConstraintTerms terms;
  system.Constraints(q, Vector::Zero(system.dof()), &terms);
  // The ball of radius 0.05 m is 0.9 m below the base.
  EXPECT_NEAR(2 - 0.9 - 0.05, terms.gap(0), 1e-12);
  EXPECT_NEAR((-0.7 + 2 * 1.1) / std::sqrt(5.) + 0.3 - 0.05, terms.gap(1), 1e-12);

  const std::string folder = testing::TempDir();
  std::ofstream(folder + "contacts_test_hall.yaml") << terrain << "\n";
  EXPECT_EQ(2u, Parse(Walker(),
                      "{base: floating, contacts: {ground: [foot]}, "
                      "terrain: contacts_test_hall.yaml}",
                      folder)
                    .constraints.size());
  EXPECT_EQ(8u, Parse(Walker(), "{base: floating, terrain: contacts_test_hall.yaml}", folder)
                    .constraints.size());
  std::remove((folder + "contacts_test_hall.yaml").c_str());
  const struct {
    const char* terrain;
    const char* words;
  } cases[] = {
      {"{a: {kind: mesh}}", "terrain/a/kind 'mesh' has edges"},
      {"{a: {kind: plain}}", "unknown terrain/a/kind 'plain'; did you mean 'plane'?"},
      {"{a: {kind: plane, radius: 1}}", "terrain/a/radius is of a contact"},
      {"{a: {kind: plane, axis: [1, 0, 0]}}", "terrain/a/axis is of a contact"},
      {"{a: {normal: [0, 0, 1]}}", "terrain/a: 'kind' is missing"},
      {"{a: {kind: height_field}}", "link 'foot' is round"},
      {"nowhere.yaml", "nowhere.yaml"},
      {"{a: {kind: plane, nromal: [0, 0, 1]}}", "'normal'"},
  };
  for (const auto& bad : cases) {
    const std::string refusal = GeometryRefusal(
        Walker(),
        "{base: floating, contacts: {ground: [foot]}, terrain: " + std::string(bad.terrain) + "}");
    EXPECT_NE(std::string::npos, refusal.find(bad.words)) << refusal << " of " << bad.terrain;
  }
}

TEST(Contacts, RefuseWithLineValueAndRemedy) {
  const struct {
    const char* yaml;
    const char* words;
  } cases[] = {
      {"{ground: foo}", "contacts/ground: unknown link 'foo'; did you mean 'foot'? (line 1)"},
      {"{ground: [foot, legs]}", "unknown link 'legs'"},
      {"{grund: feet}", "contacts: 'ground' is missing; there is 'grund' (line 1)"},
      {"{ground: feet, restitution: 2}", "contacts/restitution is 2, expected 0 to 1 (line 1)"},
      {"{ground: feet, vertices: 0}", "contacts/vertices"},
      {"{ground: feet, vertices: 100}", "contacts/vertices"},
      {"{ground: feet, tolerance: -1}", "contacts/tolerance is negative (line 1)"},
      {"{ground: feet, heigth: 1}", "did you mean"},
      {"feet", "contacts is 'feet', expected a map"},
  };
  for (const auto& bad : cases) {
    const std::string refusal =
        GeometryRefusal(Walker(), "{base: floating, contacts: " + std::string(bad.yaml) + "}");
    EXPECT_NE(std::string::npos, refusal.find(bad.words)) << refusal << " of " << bad.yaml;
  }
}

}  // namespace
}  // namespace contact_flow
